//! The two pipelines, stage by stage. The setting `pipeline.method` chooses between them.
//!
//! | stage | `default` | `paper` (arXiv 2411.05524) |
//! |---|---|---|
//! | fit | one-sided robust surface over the stroke tops on both sides of the mesh; the print helps to find the carved side | PCA, upper set, spaced selection, RANSAC, PCA (III-A) |
//! | depth | z-buffer along the normal, heights over the surface (III-B) | the same |
//! | normalize | ink of the print under every likely polarity, heights of tops and ground | fixed grey, both images scaled by bounding box and centred by centroid, density and structure thresholds (III-C) |
//! | register | pose search on soft strokes, refinement, then thresholds in the aligned frame, scores, confidence | rotations in equal steps, shifts by hill climbing on the IoU, scores (III-D) |
//!
//! The fit stage reads the print to decide the carved side. The page of the crate gives the reason.

use std::num::NonZeroU64;

use super::depth::{self, DepthError};
use super::fit::{self, ExpectedFace, FitError};
use super::normalize::{self, NormalizeError, Normalized};
use super::paper_method;
use super::print::Print;
use super::register::{self, ExpectedPose, RegisterError, Registered};
use super::scan::Scan;
use super::settings::{AlignmentMethod, Settings};
use mocban_core::domain::{
    FailureClass, FitOutcome, LengthUnit, MetricOutcome, PrintFromMesh, ThresholdMetric,
};
use mocban_core::raster::DepthMap;

/// Why a stage found no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StageError {
    /// From the fit stage.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// From the depth stage.
    #[error(transparent)]
    Depth(#[from] DepthError),
    /// From the normalize stage.
    #[error(transparent)]
    Normalize(#[from] NormalizeError),
    /// From the register stage.
    #[error(transparent)]
    Register(#[from] RegisterError),
}

impl StageError {
    /// Returns what the failure means for the pair.
    pub fn class(&self) -> FailureClass {
        match self {
            Self::Fit(error) => error.class(),
            Self::Depth(error) => error.class(),
            Self::Normalize(error) => error.class(),
            Self::Register(error) => error.class(),
        }
    }

    /// Returns whether the print is the likelier cause. It is if the characters do not match and nothing is unusual about
    /// the scan.
    pub const fn is_of_print(&self) -> bool {
        match self {
            Self::Normalize(NormalizeError::Print(_)) => true,
            Self::Register(
                RegisterError::NoMatch { seen, .. } | RegisterError::OtherCharacter { seen, .. },
            ) => !seen.is_of_scan(),
            _ => false,
        }
    }
}

impl Settings {
    /// Returns whether the fit stage reads the print. If it does not, its results stay valid when the print changes.
    pub const fn fit_reads_print(&self) -> bool {
        matches!(self.pipeline.method, AlignmentMethod::Default)
    }
}

/// Finds the character plane and the carved side of a mesh. The manifest may give `scanned_face_down`. `expected` is the face
/// that the scan of a whole block shows around the character; the method of the paper does not use it.
///
/// # Errors
/// Returns an error if no plane is found or nothing is carved.
pub fn fit(
    scan: &Scan,
    print: Option<&Print>,
    scanned_face_down: Option<bool>,
    expected: Option<&ExpectedFace>,
    settings: &Settings,
) -> Result<FitOutcome, FitError> {
    let params = &settings.fit;
    let mut outcome = match (settings.pipeline.method, expected) {
        (AlignmentMethod::Default, None) => fit::fit(scan, print, scanned_face_down, params),
        (AlignmentMethod::Default, Some(face)) => {
            fit::fit_in_block(scan, print, scanned_face_down, face, params)
        }
        (AlignmentMethod::Paper, _) => paper_method::fit::fit(scan, params),
    }?;
    outcome.missing_vertices = NonZeroU64::new(scan.losses().missing_vertices);
    outcome.incomplete_faces = NonZeroU64::new(scan.losses().incomplete_faces);
    Ok(outcome)
}

/// Prepares print and depth map for registration.
///
/// # Errors
/// Returns an error if the print shows no ink or the depth map no strokes.
pub fn normalize(
    depth: &DepthMap,
    print: &Print,
    settings: &Settings,
) -> Result<Normalized, NormalizeError> {
    let mut normalized = match settings.pipeline.method {
        AlignmentMethod::Default => normalize::normalize(depth, print, &settings.normalize),
        AlignmentMethod::Paper => {
            paper_method::normalize::normalize(depth, print, &settings.normalize)
        }
    }?;
    normalized.outcome.print_orientation = print.image().turned;
    let ignored = &print.image().ignored_profile;
    normalized.outcome.ignored_profile.clone_from(ignored);
    Ok(normalized)
}

/// Aligns the depth map with the print and scores each metric's masks. `expected` is the pose that is expected from the
/// registration of a whole block; the method of the paper does not use it.
///
/// # Errors
/// Returns an error if no pose is found or trusted, or a threshold leaves no strokes.
pub fn register(
    depth: &DepthMap,
    normalized: &Normalized,
    expected: Option<&ExpectedPose>,
    settings: &Settings,
) -> Result<Registered, RegisterError> {
    match settings.pipeline.method {
        AlignmentMethod::Default => {
            register::register(depth, normalized, expected, &settings.register)
        }
        AlignmentMethod::Paper => {
            paper_method::register::register(depth, normalized, &settings.register)
        }
    }
}

/// What is known of a scan apart from its mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ScanHints {
    /// Unit of the mesh.
    pub unit: Option<LengthUnit>,
    /// Whether the carved face points towards -z of the mesh.
    pub scanned_face_down: Option<bool>,
}

/// Results of the four stages for one mesh and print.
#[derive(Debug, Clone)]
pub struct AlignedPair {
    /// What was known of the scan.
    pub hints: ScanHints,
    /// The plane.
    pub fit: FitOutcome,
    /// The depth map, which reads like the print, levelled as the registration requires.
    pub depth: DepthMap,
    /// Ink and canvas of the print, heights of the relief.
    pub normalized: Normalized,
    /// One alignment a metric.
    pub registered: Registered,
}

impl AlignedPair {
    /// Runs the four stages. The unit of the mesh and the direction of its carved face count as unknown.
    ///
    /// # Errors
    /// Returns the error of the first stage that finds no result.
    ///
    /// # Examples
    /// ```
    /// # use mocban_core::raster;
    /// # use mocban_demo as demo;
    /// # let settings = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/default_settings.in"))?;
    /// # let pair = demo::PairGenerator::new(demo::Tier::Pose, 7).with_vertices(Some(20_000)).pair(0)?;
    /// # let image = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED)?;
    /// use mocban_core::domain::ThresholdMetric;
    /// use mocban_align::stages::{AlignedPair, AlignmentMethod, Print};
    ///
    /// let vertex = pair.mesh.vertices.at(0);
    /// let (scan, print) = (pair.mesh.into(), Print::from(image));
    /// let ours = AlignedPair::new(&scan, &print, &settings)?;
    /// let relief = ours.metric(ThresholdMetric::Relief).ok_or("no result")?;
    /// // Print pixel of a mesh vertex, and its height over the plane in mesh units.
    /// let [x, y, height] = ours.print_from_mesh(relief).apply(vertex);
    /// assert!(x.is_finite() && y.is_finite() && height.is_finite());
    ///
    /// let mut paper = settings.clone();
    /// paper.pipeline.method = AlignmentMethod::Paper;
    /// let theirs = AlignedPair::new(&scan, &print, &paper)?;
    /// assert_eq!(theirs.metrics().len(), 3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(scan: &Scan, print: &Print, settings: &Settings) -> Result<Self, StageError> {
        Self::with_hints(scan, print, ScanHints::default(), settings)
    }

    /// Runs the four stages, as a project does for a pair of its list.
    ///
    /// # Errors
    /// Returns the error of the first stage that finds no result.
    pub fn with_hints(
        scan: &Scan,
        print: &Print,
        hints: ScanHints,
        settings: &Settings,
    ) -> Result<Self, StageError> {
        let fit = fit(scan, Some(print), hints.scanned_face_down, None, settings)?;
        let depth = depth::depth(scan, &fit, hints.unit, &settings.depth)?;
        let normalized = match &fit.print_outline {
            Some(outline) => normalize(&depth, &print.clone().within(Some(outline)), settings),
            None => normalize(&depth, print, settings),
        }?;
        let registered = register(&depth, &normalized, None, settings)?;
        Ok(Self {
            hints,
            fit,
            depth: registered.levelled(depth),
            normalized,
            registered,
        })
    }

    /// Returns one alignment a metric.
    pub fn metrics(&self) -> &[MetricOutcome] {
        &self.registered.outcome.metrics
    }

    /// Returns a metric's alignment, if the method gives the metric.
    pub fn metric(&self, metric: ThresholdMetric) -> Option<&MetricOutcome> {
        self.metrics().iter().find(|found| found.metric == metric)
    }

    /// Returns the alignment that is shown first: that of `relief`, or of the default metric under the paper's method.
    pub fn first_metric(&self) -> &MetricOutcome {
        let found = self.metric(ThresholdMetric::Relief);
        found
            .or_else(|| self.metric(ThresholdMetric::DEFAULT))
            .unwrap_or(&self.metrics()[0])
    }

    /// Returns the map from mesh points to print pixels under a metric's alignment.
    pub fn print_from_mesh(&self, metric: &MetricOutcome) -> PrintFromMesh {
        PrintFromMesh::new(
            &metric.print_from_depth,
            &self.depth.scale.depth_from_plane,
            &self.fit.plane_from_mesh,
        )
    }
}

//! The stored outcomes and artifacts of a pair: maps, depth map, masks.

use serde::de::DeserializeOwned;

use mocban_catalog::{MetricRecord, PairResults, StageRecord};
use mocban_core::domain::artifact_role::{CANVAS_PRINT_MASK, DEPTH, print_mask};
use mocban_core::domain::{
    Affine2, ArtifactRef, DepthOutcome, DisplacedPart, FitOutcome, Levelling, MaskScale,
    MetricOutcome, NormalizeOutcome, PrintFromMesh, RegisterOutcome, Stage,
};
use mocban_core::raster::{
    DepthMap, Grid, Mask, PngError, decode_grey8, decode_grey16, mask_of_print,
};
use mocban_store::Project;

/// Value of ink or strokes in a stored mask.
const INK: u8 = 255;

/// Why a stored result cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PairArtifactsError {
    /// The catalog holds no result of the stage.
    #[error("there is no result of {0}")]
    NoResult(Stage),
    /// The stored outcome has another form.
    #[error("the stored result of {stage} cannot be read: {source}")]
    Outcome {
        /// Which stage.
        stage: Stage,
        /// Why.
        source: serde_json::Error,
    },
    /// The result has no such artifact.
    #[error("the result of {stage} has no {role}")]
    NoArtifact {
        /// Which stage.
        stage: Stage,
        /// Which artifact.
        role: String,
    },
    /// The artifact cannot be read.
    #[error(transparent)]
    Store(#[from] mocban_store::ArtifactError),
    /// The artifact is not a valid image.
    #[error("{role}: {source}")]
    Image {
        /// Which artifact.
        role: String,
        /// Why.
        source: PngError,
    },
}

/// Reads the stored outcomes and artifacts of a finished pair.
#[derive(Debug, Clone, Copy)]
pub struct PairArtifacts<'a> {
    project: &'a Project,
    pair: &'a PairResults,
}

impl<'a> PairArtifacts<'a> {
    /// Returns the reader for a pair of a project.
    pub const fn new(project: &'a Project, pair: &'a PairResults) -> Self {
        Self { project, pair }
    }

    /// Returns the current result of a stage.
    ///
    /// # Errors
    /// Returns an error if the stage has no result.
    pub fn stage(&self, stage: Stage) -> Result<&'a StageRecord, PairArtifactsError> {
        let found = self.pair.stage(stage);
        found.ok_or(PairArtifactsError::NoResult(stage))
    }

    /// Parses the outcome of a stage, such as [`FitOutcome`].
    ///
    /// # Errors
    /// Returns an error if the stage has no result, or its outcome has another form.
    pub fn outcome<T: DeserializeOwned>(&self, stage: Stage) -> Result<T, PairArtifactsError> {
        self.stage(stage)?
            .parse()
            .map_err(|source| PairArtifactsError::Outcome { stage, source })
    }

    /// Returns an artifact of a stage by its role.
    ///
    /// # Errors
    /// Returns an error if the stage has no result, or the result has no artifact of that role.
    pub fn artifact(
        &self,
        stage: Stage,
        role: &str,
    ) -> Result<&'a ArtifactRef, PairArtifactsError> {
        let missing = || PairArtifactsError::NoArtifact {
            stage,
            role: role.to_owned(),
        };
        self.stage(stage)?.files.get(role).ok_or_else(missing)
    }

    /// Reads an artifact and checks its hash.
    ///
    /// # Errors
    /// Returns an error if there is no such artifact, or its file is missing or was changed.
    pub fn bytes(&self, stage: Stage, role: &str) -> Result<Vec<u8>, PairArtifactsError> {
        Ok(self.project.read_artifact(self.artifact(stage, role)?)?)
    }

    /// Reads the depth map with its scale, levelled as its registration requires.
    ///
    /// # Errors
    /// Returns an error if the result or the image of the depth stage cannot be read.
    pub fn depth(&self) -> Result<DepthMap, PairArtifactsError> {
        self.decode_depth(&self.bytes(Stage::Depth, DEPTH)?)
    }

    /// Decodes the bytes of the depth map's artifact, and levels the map if the registration did. Thresholds refer to the
    /// result.
    ///
    /// # Errors
    /// Returns an error if the result of the depth stage cannot be read, or the bytes are not an image.
    pub fn decode_depth(&self, bytes: &[u8]) -> Result<DepthMap, PairArtifactsError> {
        let outcome: DepthOutcome = self.outcome(Stage::Depth)?;
        let levels = decode_grey16(bytes);
        let map = DepthMap {
            levels: levels.map_err(undecodable(DEPTH))?,
            scale: outcome.scale,
        };
        Ok(match self.levelling()? {
            Some(levelling) => map.levelled(&levelling),
            None => map,
        })
    }

    /// Returns the levelling that the registration found, if any.
    fn levelling(&self) -> Result<Option<Levelling>, PairArtifactsError> {
        Ok(self.registered()?.and_then(|register| register.levelling))
    }

    /// Returns the displaced part of the print, if the registration found one.
    ///
    /// # Errors
    /// Returns an error if the result of the register stage cannot be read.
    pub fn displaced(&self) -> Result<Option<DisplacedPart>, PairArtifactsError> {
        Ok(self.registered()?.and_then(|register| register.displaced))
    }

    /// Returns the result of the register stage. `None` if there is none.
    fn registered(&self) -> Result<Option<RegisterOutcome>, PairArtifactsError> {
        let has_result = self.pair.stage(Stage::Register).is_some();
        has_result
            .then(|| self.outcome(Stage::Register))
            .transpose()
    }

    /// Reads the ink mask of the print. The mask has the frame and the size of the print image.
    ///
    /// # Errors
    /// Returns an error if the mask cannot be read.
    pub fn print_mask(&self) -> Result<Mask, PairArtifactsError> {
        let ink = self.print_grey()?.map(|value| *value == INK);
        Ok(mask_of_print(&ink, self.mask_scale()?))
    }

    /// Reads the stored image of the masks of the print, which is enlarged if the print is small and reduced if it is large.
    /// For its values, see
    /// [`print_mask`].
    ///
    /// # Errors
    /// Returns an error if the mask cannot be read.
    pub fn print_grey(&self) -> Result<Grid<u8>, PairArtifactsError> {
        let register = self.outcome::<RegisterOutcome>(Stage::Register);
        let ink = register.map_or(0, |outcome| outcome.ink);
        self.grey(Stage::Normalize, &print_mask(ink))
    }

    /// Returns the size of the image of [`Self::print_grey`] relative to the print.
    ///
    /// # Errors
    /// Returns an error if the result of the normalize stage cannot be read.
    pub fn mask_scale(&self) -> Result<MaskScale, PairArtifactsError> {
        Ok(self
            .outcome::<NormalizeOutcome>(Stage::Normalize)?
            .mask_scale())
    }

    /// Returns the map from print pixels to pixels of the canvas on which scores are computed.
    ///
    /// # Errors
    /// Returns an error if the result of the normalize or register stage cannot be read.
    pub fn canvas_from_print(&self) -> Result<Affine2, PairArtifactsError> {
        let normalize: NormalizeOutcome = self.outcome(Stage::Normalize)?;
        let register: RegisterOutcome = self.outcome(Stage::Register)?;
        let ink = normalize.inks.get(register.ink);
        let missing = || PairArtifactsError::NoArtifact {
            stage: Stage::Normalize,
            role: print_mask(register.ink),
        };
        ink.map(|ink| ink.canvas_from_print).ok_or_else(missing)
    }

    /// Reads the ink mask of the print on the canvas on which scores are computed.
    ///
    /// # Errors
    /// Returns an error if the mask cannot be read.
    pub fn canvas_print_mask(&self) -> Result<Mask, PairArtifactsError> {
        self.mask(Stage::Register, CANVAS_PRINT_MASK)
    }

    fn mask(&self, stage: Stage, role: &str) -> Result<Mask, PairArtifactsError> {
        Ok(self.grey(stage, role)?.map(|value| *value == INK))
    }

    /// Reads a stored 8-bit grey picture.
    ///
    /// # Errors
    /// Returns an error if the picture cannot be read.
    pub fn grey(&self, stage: Stage, role: &str) -> Result<Grid<u8>, PairArtifactsError> {
        decode_grey8(&self.bytes(stage, role)?).map_err(undecodable(role))
    }

    /// Converts `print_from_mesh` to a map from depth-map pixels to print pixels, for points on the fitted plane.
    /// Returns `None` if `depth_from_plane` is singular.
    ///
    /// # Errors
    /// Returns an error if the result of the fit or depth stage cannot be read.
    pub fn print_from_depth(
        &self,
        print_from_mesh: &PrintFromMesh,
    ) -> Result<Option<Affine2>, PairArtifactsError> {
        let fit: FitOutcome = self.outcome(Stage::Fit)?;
        let depth: DepthOutcome = self.outcome(Stage::Depth)?;
        let mesh_from_plane = fit.plane_from_mesh.inverse();
        let print = |[x, y]: [f64; 2]| {
            let [u, v, _] = print_from_mesh.apply(mesh_from_plane.apply([x, y, 0.0]));
            [u, v]
        };
        let plane_from_depth = depth.scale.depth_from_plane.inverse();
        Ok(plane_from_depth.map(|plane| {
            let [origin, across, down] =
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|px| print(plane.apply(px)));
            let row = |i: usize| [across[i] - origin[i], down[i] - origin[i], origin[i]];
            Affine2([row(0), row(1)])
        }))
    }

    /// Computes the map from mesh to print from a metric's `print_from_depth`, the fit and the depth scale.
    ///
    /// # Errors
    /// Returns an error if the result of the fit or depth stage cannot be read.
    pub fn print_from_mesh(
        &self,
        print_from_depth: &Affine2,
    ) -> Result<PrintFromMesh, PairArtifactsError> {
        let fit: FitOutcome = self.outcome(Stage::Fit)?;
        let depth: DepthOutcome = self.outcome(Stage::Depth)?;
        Ok(PrintFromMesh::new(
            print_from_depth,
            &depth.scale.depth_from_plane,
            &fit.plane_from_mesh,
        ))
    }
}

/// Returns a conversion of decoding errors of an artifact.
fn undecodable(role: &str) -> impl Fn(PngError) -> PairArtifactsError {
    move |source| PairArtifactsError::Image {
        role: role.to_owned(),
        source,
    }
}

/// Returns whether two results have the same threshold and alignment. If so, all their images are equal.
pub fn same_alignment(a: &MetricOutcome, b: &MetricOutcome) -> bool {
    a.threshold_level == b.threshold_level && a.print_from_depth == b.print_from_depth
}

/// Groups results with equal images, in the order of their first members.
pub fn group_identical<'a>(
    records: impl IntoIterator<Item = &'a MetricRecord>,
) -> Vec<Vec<&'a MetricRecord>> {
    let mut groups: Vec<Vec<&MetricRecord>> = Vec::new();
    for record in records {
        let is_alike =
            |group: &&mut Vec<&MetricRecord>| same_alignment(&group[0].outcome, &record.outcome);
        match groups.iter_mut().find(is_alike) {
            Some(group) => group.push(record),
            None => groups.push(vec![record]),
        }
    }
    groups
}

//! Reads the print image of a pair and draws the images of a result.

use std::borrow::Cow;
use std::path::PathBuf;

use super::pictures::{PrintView, Rgb};
use mocban_catalog::PairResults;
use mocban_core::domain::{ContentHash, FileKind, Stage, ThresholdMetric};
use mocban_core::raster::{self, DecodeError, ImageLimits, PrintImage, png_rgb8};
use mocban_results::pair_artifacts::PairArtifacts;
use mocban_store::{InputError, InputFile, Project, read_input};

/// Why a print cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SourcePrintError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] InputError),
    /// The file cannot be decoded, for example because limits were lowered.
    #[error("{path}: {source}")]
    Decode {
        /// The print.
        path: PathBuf,
        /// Why.
        source: DecodeError,
    },
    /// The file is not the one that was aligned.
    #[error("{0} has changed since it was aligned; run again")]
    Changed(PathBuf),
}

/// A print image as a file and decoded.
#[derive(Debug)]
pub struct SourcePrint {
    file: InputFile,
    /// The decoded image.
    pub picture: PrintImage,
}

impl SourcePrint {
    /// Returns the hash of the file.
    pub const fn hash(&self) -> ContentHash {
        self.file.version.hash
    }

    /// Reads the print of a pair and checks that it has not changed since it was aligned.
    ///
    /// # Errors
    /// Returns an error if the print cannot be read or decoded, or has changed.
    pub fn read(
        project: &Project,
        pair: &PairResults,
        limits: &ImageLimits,
    ) -> Result<Self, SourcePrintError> {
        let normalized = pair.stage(Stage::Normalize);
        let aligned = normalized.and_then(|record| record.print_hash);
        Self::read_stored(project, &pair.attributes.print_path, aligned, limits)
    }

    /// Reads an image by its path in the catalog, and checks that it has the hash of the aligned one, if that is known.
    ///
    /// # Errors
    /// Returns an error if the image cannot be read or decoded, or has changed.
    pub fn read_stored(
        project: &Project,
        path: &str,
        aligned: Option<ContentHash>,
        limits: &ImageLimits,
    ) -> Result<Self, SourcePrintError> {
        let file = Self::read_file(project, path, limits)?;
        let path = project.input(path).path().to_owned();
        if aligned.is_some_and(|hash| hash != file.version.hash) {
            return Err(SourcePrintError::Changed(path));
        }
        Self::decoded(file, path, limits)
    }

    /// Reads the file of an image by its path in the catalog.
    pub(super) fn read_file(
        project: &Project,
        path: &str,
        limits: &ImageLimits,
    ) -> Result<InputFile, SourcePrintError> {
        let input = project.input(path);
        Ok(read_input(
            &input,
            limits.max_bytes,
            "limits.image.max_bytes",
        )?)
    }

    /// Decodes the file of an image; `path` names it in errors.
    pub(super) fn decoded(
        file: InputFile,
        path: PathBuf,
        limits: &ImageLimits,
    ) -> Result<Self, SourcePrintError> {
        match raster::decode(&file.bytes, limits) {
            Ok(picture) => Ok(Self { file, picture }),
            Err(source) => Err(SourcePrintError::Decode { path, source }),
        }
    }

    /// Returns a file whose stored pixels are upright: the original, or a PNG if the original has an EXIF orientation.
    /// Some programs ignore EXIF orientations.
    pub(super) fn upright_file(&self) -> Cow<'_, [u8]> {
        match self.picture.turned {
            None => Cow::Borrowed(&self.file.bytes),
            Some(_) => Cow::Owned(png_rgb8(&self.picture.rgb.to_rgb8())),
        }
    }

    /// Returns the file name extension of its format.
    pub(super) fn extension(&self) -> &'static str {
        match FileKind::of(&self.file.bytes) {
            _ if self.picture.turned.is_some() => "png",
            FileKind::Png => "png",
            FileKind::Jpeg => "jpg",
            FileKind::Tiff => "tif",
            _ => "img",
        }
    }
}

/// Draws the print, the aligned relief and the overlay of a metric's result. The longest side of each is `side` pixels.
///
/// An image that cannot be drawn is `None`. If the pair has a result, but its print or depth map cannot be read, also
/// returns the reason as text.
pub(super) fn result_images(
    project: &Project,
    pair: &PairResults,
    metric: ThresholdMetric,
    side: usize,
    limits: &ImageLimits,
) -> ([Option<Rgb>; 3], Option<String>) {
    let print = match SourcePrint::read(project, pair, limits) {
        Ok(print) => print,
        // If there is no result, the stored failure of the pair already names the problem.
        Err(error) => {
            let has_result = pair.metric(metric).is_some();
            return ([None, None, None], has_result.then(|| error.to_string()));
        }
    };
    let view = PrintView::of_side(&print.picture, side);
    let plain = Some(view.print(&print.picture));
    let Some(record) = pair.metric(metric) else {
        return ([plain, None, None], None);
    };
    let artifacts = PairArtifacts::new(project, pair);
    match artifacts
        .depth()
        .and_then(|depth| Ok((depth, artifacts.displaced()?)))
    {
        Ok((depth, displaced)) => {
            let relief = view.relief(&depth, &record.outcome.print_from_depth);
            let outcome = &record.outcome;
            let overlay = view.overlay(&print.picture, &depth, outcome, displaced.as_ref());
            ([plain, Some(relief), Some(overlay)], None)
        }
        Err(error) => ([plain, None, None], Some(error.to_string())),
    }
}

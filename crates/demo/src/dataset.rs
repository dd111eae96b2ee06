//! Writes the dataset to disk: manifest, meshes, print images and ground truth.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::generator::PairGenerator;
use super::pair::DemoPair;
use super::scene::pair_id;
use super::tier::Tier;
use super::truth_line::tops_file;
use mocban_core::domain::Explained;
use mocban_core::raster::png_grey8;

/// Increased whenever the same options produce different bytes.
const REVISION: u32 = 3;
/// Number of consecutive pairs with the same block in the manifest.
const PAIRS_PER_BLOCK: u64 = 12;
/// Written last; its presence marks a complete dataset.
const STAMP_FILE: &str = "dataset.json";

/// Size, seed and tier of a dataset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DemoOptions {
    /// Number of pairs; at most 20 for the `real` tier.
    pub pairs: u64,
    /// Random seed; the same seed gives the same bytes.
    pub seed: u64,
    /// Difficulty.
    pub tier: Tier,
}

impl DemoOptions {
    /// Returns the options with at most as many pairs as the tier has.
    #[must_use]
    pub fn limited(self) -> Self {
        let max_pairs = self.tier.max_pairs().unwrap_or(u64::MAX);
        Self {
            pairs: self.pairs.min(max_pairs),
            ..self
        }
    }
}

/// Paths of a dataset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatasetFiles {
    /// `manifest.csv`, the input of `mocban import`.
    pub manifest: PathBuf,
    /// `truth.jsonl`.
    pub truth: PathBuf,
    /// Number of pairs.
    pub pairs: u64,
}

/// A failure to write the dataset.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A directory or file could not be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The path.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// An image could not be encoded, or an embedded one not decoded.
    #[error("image of pair {id}: {source}")]
    Image {
        /// The pair.
        id: String,
        /// The codec's error.
        source: image::ImageError,
    },
    /// Stopped before the dataset was complete.
    #[error("stopped while the demo files were written")]
    Stopped,
}

impl Explained for DatasetError {}

/// Content of `dataset.json`.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct DatasetStamp {
    schema: u32,
    revision: u32,
    #[serde(flatten)]
    options: DemoOptions,
}

/// One line of `manifest.csv`.
#[derive(Debug, Clone, Serialize)]
struct ManifestLine {
    id: String,
    mesh: String,
    print: String,
    character: String,
    block: String,
    unit: Option<&'static str>,
    scanned_face_down: Option<bool>,
    closed: bool,
    tier: Tier,
}

/// Writes the dataset below `dir`, unless a complete dataset with the same options is already there.
///
/// Writes `manifest.csv`, `truth.jsonl`, `meshes/`, `prints/` and `tops/`, then `dataset.json`. If a run is killed
/// before it writes `dataset.json`, the next run replaces all files. Calls `is_stopped` before each pair.
///
/// # Errors
/// Returns an error if an image cannot be encoded, a file cannot be written or `is_stopped` returns true.
pub fn write_dataset(
    dir: &Path,
    options: &DemoOptions,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<DatasetFiles, DatasetError> {
    if let Some(files) = find_dataset(dir, options) {
        return Ok(files);
    }
    let stamp = DatasetStamp::of(options);
    write_all(dir, &stamp.options, is_stopped)?;
    let file = dir.join(STAMP_FILE);
    write(&file, &json_line(&file, &stamp)?)?;
    Ok(DatasetFiles::of(dir, &stamp))
}

/// Returns the dataset below `dir` if it is complete and has these options.
pub fn find_dataset(dir: &Path, options: &DemoOptions) -> Option<DatasetFiles> {
    let stamp = DatasetStamp::of(options);
    let bytes = fs::read(dir.join(STAMP_FILE)).ok()?;
    let found: DatasetStamp = serde_json::from_slice(&bytes).ok()?;
    (found == stamp).then(|| DatasetFiles::of(dir, &stamp))
}

impl DatasetStamp {
    fn of(options: &DemoOptions) -> Self {
        Self {
            schema: 1,
            revision: REVISION,
            options: options.limited(),
        }
    }
}

impl DatasetFiles {
    fn of(dir: &Path, stamp: &DatasetStamp) -> Self {
        Self {
            manifest: dir.join("manifest.csv"),
            truth: dir.join("truth.jsonl"),
            pairs: stamp.options.pairs,
        }
    }
}

fn write_all(
    dir: &Path,
    options: &DemoOptions,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<(), DatasetError> {
    for folder in ["meshes", "prints", "tops"] {
        // Files of an earlier dataset would not be listed in the new manifest.
        clear_folder(&dir.join(folder))?;
    }
    let pairs = PairGenerator::new(options.tier, options.seed);
    let lines = (0..options.pairs)
        .into_par_iter()
        .map(|index| {
            if is_stopped() {
                return Err(DatasetError::Stopped);
            }
            write_pair(dir, &pairs, index)
        })
        .collect::<Result<Vec<_>, DatasetError>>()?;
    let (rows, truths): (Vec<ManifestLine>, Vec<Vec<u8>>) = lines.into_iter().unzip();
    write_manifest(&dir.join("manifest.csv"), &rows)?;
    write(&dir.join("truth.jsonl"), &truths.concat())
}

/// Makes one pair, writes its files and returns its manifest and truth lines.
fn write_pair(
    dir: &Path,
    pairs: &PairGenerator,
    index: u64,
) -> Result<(ManifestLine, Vec<u8>), DatasetError> {
    let (tier, tier_index) = pairs.tier().tier_and_index(index);
    let pair = pairs.pair(index).map_err(|source| DatasetError::Image {
        id: pair_id(tier, tier_index),
        source,
    })?;
    let manifest_line = manifest_line(&pair, tier, tier_index);
    write(
        &dir.join(&manifest_line.mesh),
        &pair.mesh_format.encode(&pair.mesh),
    )?;
    write(&dir.join(&manifest_line.print), &pair.print)?;
    write(&dir.join(tops_file(&pair.id)), &png_grey8(&pair.tops))?;
    let truth = json_line(&dir.join("truth.jsonl"), &pair.truth)?;
    Ok((manifest_line, truth))
}

fn manifest_line(pair: &DemoPair, tier: Tier, index: u64) -> ManifestLine {
    ManifestLine {
        id: pair.id.clone(),
        mesh: format!("meshes/{}.{}", pair.id, pair.mesh_format.extension()),
        print: format!("prints/{}.{}", pair.id, pair.print_extension),
        character: pair.character.clone(),
        block: format!("{tier}-block-{:02}", index / PAIRS_PER_BLOCK + 1),
        unit: pair.unit,
        scanned_face_down: pair.scanned_face_down,
        closed: pair.is_closed,
        tier,
    }
}

fn write_manifest(path: &Path, rows: &[ManifestLine]) -> Result<(), DatasetError> {
    let mut writer = csv::Writer::from_path(path).map_err(at(path))?;
    for manifest_line in rows {
        writer.serialize(manifest_line).map_err(at(path))?;
    }
    writer.flush().map_err(at(path))
}

fn json_line(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, DatasetError> {
    let mut line = serde_json::to_vec(value).map_err(at(path))?;
    line.push(b'\n');
    Ok(line)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), DatasetError> {
    fs::write(path, bytes).map_err(at(path))
}

/// Empties a folder, or creates it.
fn clear_folder(path: &Path) -> Result<(), DatasetError> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(at(path)(error)),
        Ok(()) | Err(_) => fs::create_dir_all(path).map_err(at(path)),
    }
}

/// Adds a path to an error.
pub(super) fn at<E: Into<std::io::Error>>(path: &Path) -> impl FnOnce(E) -> DatasetError {
    |error| DatasetError::Io {
        path: path.to_owned(),
        source: error.into(),
    }
}

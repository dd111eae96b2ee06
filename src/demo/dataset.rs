//! A dataset on disk: ordinary files that anybody could have made.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::pair::Pair;
use super::pairs::Pairs;
use super::tier::Tier;
use crate::raster::png_grey8;

/// Raised whenever the same options give other bytes than before.
const REVISION: u32 = 2;
/// Pairs that share a block in the manifest.
const PAIRS_PER_BLOCK: u64 = 12;
/// Written last: a dataset that has it is whole.
const SEAL: &str = "dataset.json";

/// What to make.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DemoOptions {
    /// How many pairs; the real tier has 20 at most.
    pub pairs: u64,
    /// Same seed, same bytes.
    pub seed: u64,
    /// How hard.
    pub tier: Tier,
}

/// Where a dataset lies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DatasetFiles {
    /// `manifest.csv`, to import.
    pub manifest: PathBuf,
    /// `truth.jsonl`.
    pub truth: PathBuf,
    /// How many pairs it holds.
    pub pairs: u64,
    /// Whether it was there already and nothing was written.
    pub was_there: bool,
}

/// Why a dataset could not be made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A folder or file could not be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Which one.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A picture could not be encoded or, from the program itself, decoded.
    #[error("picture of pair {id}: {source}")]
    Picture {
        /// Which pair.
        id: String,
        /// What the encoder said.
        source: image::ImageError,
    },
    /// Asked to stop before it was whole.
    #[error("stopped while the demo's files were made")]
    Stopped,
    /// A row could not be put into text.
    #[error("{}: {reason}", path.display())]
    Text {
        /// Which file.
        path: PathBuf,
        /// What the writer said.
        reason: String,
    },
}

/// What `dataset.json` says.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Seal {
    schema: u32,
    revision: u32,
    #[serde(flatten)]
    options: DemoOptions,
}

/// One row of the manifest.
#[derive(Debug, Clone, Serialize)]
struct Row {
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

/// Writes the dataset below `dir`, or finds it there whole, made with the same options.
///
/// `manifest.csv`, `truth.jsonl`, `meshes/`, `prints/` and `tops/` are ordinary files; `dataset.json` is written
/// last, so what a killed run left behind is made anew. `is_stopped` is asked before each pair.
///
/// # Errors
/// When a file cannot be written, or it was asked to stop.
pub fn write_dataset(
    dir: &Path,
    options: &DemoOptions,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<DatasetFiles, Error> {
    let options = DemoOptions {
        pairs: options
            .pairs
            .min(options.tier.most_pairs().unwrap_or(u64::MAX)),
        ..*options
    };
    let seal = Seal {
        schema: 1,
        revision: REVISION,
        options,
    };
    let was_there = is_sealed(dir, &seal);
    if !was_there {
        make(dir, &options, is_stopped)?;
        write(&dir.join(SEAL), &json_line(&dir.join(SEAL), &seal)?)?;
    }
    Ok(DatasetFiles {
        manifest: dir.join("manifest.csv"),
        truth: dir.join("truth.jsonl"),
        pairs: options.pairs,
        was_there,
    })
}

fn is_sealed(dir: &Path, seal: &Seal) -> bool {
    fs::read(dir.join(SEAL))
        .ok()
        .and_then(|bytes| serde_json::from_slice::<Seal>(&bytes).ok())
        .is_some_and(|found| found == *seal)
}

fn make(
    dir: &Path,
    options: &DemoOptions,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Result<(), Error> {
    for folder in ["meshes", "prints", "tops"] {
        // What another dataset left here would not be in the new manifest.
        remove_folder(&dir.join(folder))?;
        create_folder(&dir.join(folder))?;
    }
    let pairs = Pairs::new(options.tier, options.seed);
    let lines = (0..options.pairs)
        .into_par_iter()
        .map(|index| {
            if is_stopped() {
                return Err(Error::Stopped);
            }
            one(dir, &pairs, index)
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let (rows, truths): (Vec<Row>, Vec<Vec<u8>>) = lines.into_iter().unzip();
    write_manifest(&dir.join("manifest.csv"), &rows)?;
    write(&dir.join("truth.jsonl"), &truths.concat())
}

/// Makes one pair, writes its files, and returns its rows. Nothing else of it stays in memory.
fn one(dir: &Path, pairs: &Pairs, index: u64) -> Result<(Row, Vec<u8>), Error> {
    let tier = pairs.tier();
    let pair = pairs.pair(index).map_err(|source| Error::Picture {
        id: super::pair::id_of(tier, index),
        source,
    })?;
    let row = row(&pair, tier, index);
    write(&dir.join(&row.mesh), &pair.mesh_format.encode(&pair.mesh))?;
    write(&dir.join(&row.print), &pair.print)?;
    write(&dir.join(&pair.truth.tops_mask), &png_grey8(&pair.tops))?;
    let truth = json_line(&dir.join("truth.jsonl"), &pair.truth)?;
    Ok((row, truth))
}

fn row(pair: &Pair, tier: Tier, index: u64) -> Row {
    Row {
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

fn write_manifest(path: &Path, rows: &[Row]) -> Result<(), Error> {
    let text_error = |error: csv::Error| Error::Text {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(text_error)?;
    }
    let bytes = writer.into_inner().map_err(|error| Error::Text {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    write(path, &bytes)
}

fn json_line(path: &Path, value: &impl Serialize) -> Result<Vec<u8>, Error> {
    let mut line = serde_json::to_vec(value).map_err(|error| Error::Text {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    line.push(b'\n');
    Ok(line)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    fs::write(path, bytes).map_err(|source| Error::Io {
        path: path.to_owned(),
        source,
    })
}

fn create_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(|source| Error::Io {
        path: path.to_owned(),
        source,
    })
}

fn remove_folder(path: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(Error::Io {
            path: path.to_owned(),
            source,
        }),
        Ok(()) | Err(_) => Ok(()),
    }
}

//! The formats of `export --to`.

use serde::{Deserialize, Serialize};

use mocban_core::domain::enum_names;

/// A format of `export --to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ExportFormat {
    /// One line per pair and metric, with masks and images in files.
    Jsonl,
    /// One row per pair and metric, for spreadsheets and R.
    Csv,
    /// One row per pair and metric with typed columns.
    Parquet,
    /// A dataset with image columns, for `datasets.load_dataset`.
    HuggingFace,
    /// Tar shards with one sample per pair.
    WebDataset,
    /// Scans in the frame of their prints, for `CloudCompare`, `MeshLab` and viewers.
    Mesh,
    /// Calibrated TIFF images for `ImageJ` and Fiji.
    Fiji,
    /// Strokes and characters as COCO and VIA annotations.
    Annotations,
    /// Pages that show scans on their prints in 3D.
    Viewer,
}

enum_names! {
    pub ExportFormat, "an export format":
    Jsonl = "jsonl", Csv = "csv", Parquet = "parquet", HuggingFace = "huggingface", WebDataset = "webdataset",
    Mesh = "mesh", Fiji = "fiji", Annotations = "annotations", Viewer = "viewer",
}

impl ExportFormat {
    /// Returns what the format is for, as a phrase.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Jsonl => "Lines with all numbers, and pictures as files",
            Self::Csv => "A table for spreadsheets and R",
            Self::Parquet => "A table with typed columns",
            Self::HuggingFace => "A dataset with image columns for datasets.load_dataset",
            Self::WebDataset => "Tar shards with one sample per pair",
            Self::Mesh => {
                "Scans on their prints: coloured PLY, textured GLB, matrix, MeshLab project"
            }
            Self::Fiji => "Calibrated TIFF images for ImageJ and Fiji",
            Self::Annotations => "Strokes as COCO masks and boxes, characters as VIA 2 boxes",
            Self::Viewer => "Pages that show the scan and its print in 3D, one file per pair",
        }
    }

    /// Returns whether the format writes pictures in the frame of the print, so that it can use a canvas.
    pub const fn writes_pictures(self) -> bool {
        match self {
            Self::Jsonl | Self::Parquet | Self::HuggingFace | Self::WebDataset | Self::Fiji => true,
            Self::Csv | Self::Mesh | Self::Annotations | Self::Viewer => false,
        }
    }

    /// Returns whether the format writes the part of the dataset that a pair belongs to.
    pub const fn writes_splits(self) -> bool {
        match self {
            Self::Jsonl
            | Self::Csv
            | Self::Parquet
            | Self::HuggingFace
            | Self::WebDataset
            | Self::Mesh
            | Self::Fiji
            | Self::Annotations
            | Self::Viewer => true,
        }
    }
}

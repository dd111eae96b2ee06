//! Estimates the size of an export from the results of pairs in the catalog, without reading or encoding a picture.
//!
//! The constants are means over exports of generated pairs. A test compares the estimate of every purpose of the app with a real
//! export.

use super::format::ExportFormat;
use mocban_catalog::PairResults;
use mocban_core::domain::artifact_role::DEPTH;
use mocban_core::domain::{DepthOutcome, FitOutcome, Stage};
use mocban_results::pair_artifacts::group_identical;

/// Bytes of a row of numbers in the tables of CSV, in a Parquet table, and as JSON.
const CSV_ROW: u64 = 1_700;
const PARQUET_ROW: u64 = 350;
const JSON_ROW: u64 = 3_200;
/// Bytes of a page of the 3D viewer without its data: scripts, styles and the picture of the index.
const VIEWER_PAGE: u64 = 610_000;
/// Triangles, or points of a scan without triangles, above which the viewer shows fewer.
const VIEWER_ELEMENTS: u64 = 500_000;
/// Longest side of a texture of the viewer, pixels.
const TEXTURE_SIDE: u64 = 2_048;
/// Bytes of a vertex and of a triangle in PLY, in glTF, and in the data of the viewer.
const PLY: [u64; 2] = [20, 13];
const GLB: [u64; 2] = [20, 12];
const VIEWER: [u64; 2] = [24, 12];
/// Bytes of a whole block in `blocks.jsonl`, and of a verdict in `verdicts.jsonl`.
const BLOCK_LINE: u64 = 140_000;
const VERDICT_LINE: u64 = 500;

/// Sizes of the file of a print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrintFileSize {
    /// Length of the file, bytes.
    pub bytes: u64,
    /// Number of pixels.
    pub pixels: u64,
}

/// Sizes of a pair with a result, from which those of its exported files follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExportedSizes {
    vertices: u64,
    triangles: u64,
    depth_pixels: u64,
    depth_bytes: u64,
    print: PrintFileSize,
    metrics: u64,
    /// Number of metrics whose pictures differ.
    alignments: u64,
    /// The user's columns as JSON, bytes.
    columns: u64,
}

impl ExportedSizes {
    /// Reads the sizes of a pair. Without the sizes of its print, the print is taken to be as large as the depth map. Returns `None` if
    /// the pair has no result, or one of another form.
    pub fn of(pair: &PairResults, print: Option<PrintFileSize>) -> Option<Self> {
        let fit: FitOutcome = pair.stage(Stage::Fit)?.parse().ok()?;
        let depth_record = pair.stage(Stage::Depth)?;
        let depth: DepthOutcome = depth_record.parse().ok()?;
        let depth_pixels = u64::from(depth.width) * u64::from(depth.height);
        let alignments = group_identical(&pair.metrics).len() as u64;
        (alignments > 0).then(|| Self {
            vertices: merged_vertices(&fit),
            triangles: fit.triangles,
            depth_pixels,
            depth_bytes: depth_record.files.get(DEPTH).map_or(0, |file| file.bytes),
            print: print.unwrap_or(PrintFileSize {
                bytes: depth_pixels,
                pixels: depth_pixels,
            }),
            metrics: pair.metrics.len() as u64,
            alignments,
            columns: serde_json::to_vec(&pair.attributes.meta).map_or(0, |json| json.len() as u64),
        })
    }

    /// Estimates the bytes that a format writes for the pair under all metrics. `canvas_px` is the side of its pictures if they are
    /// not as large as the print.
    pub fn bytes(&self, format: ExportFormat, canvas_px: Option<u32>) -> u64 {
        let canvas = canvas_px.map(u64::from);
        let pixels = canvas.map_or(self.print.pixels, |side| side * side);
        let row = JSON_ROW + self.columns;
        match format {
            ExportFormat::Csv => self.metrics * (CSV_ROW + self.columns),
            ExportFormat::Parquet => self.metrics * (PARQUET_ROW + self.columns / 2),
            // Print, aligned depth map and two masks.
            ExportFormat::HuggingFace | ExportFormat::WebDataset => {
                row + self.depth_bytes + 21 * pixels / 10
            }
            ExportFormat::Mesh => row + self.scan(PLY) + self.scan(GLB) + 3 * pixels / 2,
            // Three channels of 4 bytes, labels of 2 bytes, and heights of 4 bytes.
            ExportFormat::Fiji => row + 14 * pixels + 4 * self.depth_pixels,
            ExportFormat::Viewer => {
                let texture = 3 * pixels.min(TEXTURE_SIDE * TEXTURE_SIDE) / 2;
                // Base64 has four letters for three bytes.
                row + VIEWER_PAGE + 4 * (self.reduced().scan(VIEWER) + texture) / 3
            }
            ExportFormat::Jsonl => {
                let overlay_and_masks = 17 * pixels / 10 + self.depth_pixels / 40 + 5_000;
                let print = canvas.map_or(self.print.bytes, |_| 3 * pixels / 2);
                let shared = print + self.depth_bytes + 16 * pixels / 10;
                self.metrics * row + self.alignments * overlay_and_masks + shared
            }
            ExportFormat::Annotations => 2 * row,
        }
    }

    /// Returns the bytes of the scan, with these numbers of bytes for a vertex and a triangle.
    const fn scan(&self, [vertex, triangle]: [u64; 2]) -> u64 {
        vertex * self.vertices + triangle * self.triangles
    }

    /// Returns the sizes with the scan as the viewer simplifies it.
    fn reduced(mut self) -> Self {
        let elements = if self.triangles > 0 {
            self.triangles
        } else {
            self.vertices
        };
        if elements > VIEWER_ELEMENTS {
            let part = VIEWER_ELEMENTS as f64 / elements as f64;
            [self.vertices, self.triangles] =
                [self.vertices, self.triangles].map(|number| (part * number as f64) as u64);
        }
        self
    }
}

/// Returns the number of vertices once repeated ones are merged. STL repeats each one for every triangle.
const fn merged_vertices(fit: &FitOutcome) -> u64 {
    if fit.triangles > 0 && fit.vertices / 2 >= fit.triangles {
        fit.triangles / 2
    } else {
        fit.vertices
    }
}

/// Estimates the bytes of an export that belong to no pair: guide, schema, manifest, the description of tables, whole blocks and the log of
/// verdicts.
pub const fn shared_bytes(format: ExportFormat, blocks: u64, verdicts: u64) -> u64 {
    match format {
        ExportFormat::Csv => 16_000,
        ExportFormat::Parquet => 33_000,
        ExportFormat::Jsonl => {
            48_000 + blocks.saturating_mul(BLOCK_LINE) + verdicts.saturating_mul(VERDICT_LINE)
        }
        ExportFormat::HuggingFace
        | ExportFormat::WebDataset
        | ExportFormat::Mesh
        | ExportFormat::Fiji
        | ExportFormat::Annotations
        | ExportFormat::Viewer => 46_000,
    }
}

#[cfg(test)]
mod tests {
    use super::{ExportFormat, ExportedSizes, PrintFileSize};

    /// Sizes of a generated pair: a scan of PLY.
    const PAIR: ExportedSizes = ExportedSizes {
        vertices: 123_855,
        triangles: 246_204,
        depth_pixels: 492 * 512,
        depth_bytes: 359_319,
        print: PrintFileSize {
            bytes: 13_776,
            pixels: 208 * 199,
        },
        metrics: 4,
        alignments: 3,
        columns: 2,
    };

    #[test]
    fn files_of_a_pair_have_about_the_estimated_size() {
        for (format, canvas_px, written) in [
            (ExportFormat::Mesh, None, 5_678_109 + 5_492_568 + 3_500),
            (
                ExportFormat::Fiji,
                None,
                497_742 + 83_072 + 1_007_912 + 3_000,
            ),
            (ExportFormat::Viewer, None, 8_563_803 + 30_310 + 3_500),
            (ExportFormat::HuggingFace, Some(256), 503_000),
        ] {
            let estimated = PAIR.bytes(format, canvas_px);
            let off = estimated.abs_diff(written);
            assert!(off < written / 10, "{format}: {estimated}, not {written}");
        }
    }

    #[test]
    fn a_large_scan_is_smaller_in_the_viewer() {
        let large = ExportedSizes {
            vertices: 5_000_000,
            triangles: 10_000_000,
            ..PAIR
        };
        let [mesh, viewer] =
            [ExportFormat::Mesh, ExportFormat::Viewer].map(|format| large.bytes(format, None));
        assert!(
            mesh > 400_000_000 && viewer < 20_000_000,
            "{mesh}, {viewer}"
        );
        let points = ExportedSizes {
            triangles: 0,
            ..large
        };
        let viewer = points.bytes(ExportFormat::Viewer, None);
        assert!(viewer < 20_000_000, "{viewer}");
    }
}

//! One sample a pair for training: the fields of the pair, the results of its metrics, and pictures under one metric.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::pair_pictures::{PairPictures, PictureError};
use super::record::{MetricFields, PairFields, PairRecord};
use super::record_fields::{RecordField, schema_of};
use mocban_catalog::MetricRecord;
use mocban_core::domain::{PairName, ThresholdMetric};
use mocban_core::raster::{png_grey16, png_mask, png_rgb8};

/// The fields of a sample.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SampleFields<'a> {
    /// What all metrics of the pair share.
    #[serde(flatten)]
    pair: &'a PairFields,
    /// The metric whose pictures the sample has.
    #[serde(flatten)]
    metric: &'a MetricFields,
    /// Results of all selected metrics.
    metrics: &'a [MetricFields],
}

/// Names of the pictures of a sample, in the order of [`pictures`].
pub(super) const PICTURES: [&str; 5] = [
    "print",
    "print_mask",
    "depth",
    "aligned_depth",
    "aligned_mask",
];

/// The pictures of a sample, for tables of fields.
pub(super) const PICTURE_FIELDS: [(RecordField, &str); 5] = [
    (
        picture("print", "", "pictures"),
        "The print image, upright.",
    ),
    (
        picture("print_mask", "255 = ink", "pictures"),
        "Ink mask of the print, 8 bits.",
    ),
    (
        picture("depth", "level", "depth map"),
        "Depth map, 16 bits: 0 = no data, 1 to 65535 linear in height.",
    ),
    (
        picture("aligned_depth", "level", "pictures"),
        "The depth map warped onto the print.",
    ),
    (
        picture("aligned_mask", "255 = stroke", "pictures"),
        "The strokes at the metric's threshold, warped onto the print.",
    ),
];

const fn picture(name: &'static str, unit: &'static str, frame: &'static str) -> RecordField {
    RecordField { name, unit, frame }
}

/// A picture of a sample as a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SamplePicture {
    /// Name of the picture, such as `print_mask`.
    pub(super) name: &'static str,
    /// Extension of the file name.
    pub(super) extension: &'static str,
    /// The file.
    pub(super) bytes: Vec<u8>,
}

impl SamplePicture {
    /// Returns the name of the picture's file and its content, as `picture_cells` reads them. `id` is the id of the
    /// pair.
    pub(super) fn named(self, id: &PairName) -> [Vec<u8>; 2] {
        let name = format!("{}.{}.{}", id.file_name(), self.name, self.extension);
        [name.into_bytes(), self.bytes]
    }
}

/// Returns the index of the metric whose pictures a sample has: `ensemble` if it was selected, otherwise the first.
pub(super) fn chosen(metrics: &[MetricFields]) -> Option<usize> {
    let is_default = |fields: &MetricFields| fields.metric == ThresholdMetric::DEFAULT;
    let first = (!metrics.is_empty()).then_some(0);
    metrics.iter().position(is_default).or(first)
}

/// Returns the fields of a sample. `None` if the pair has no result.
pub(super) fn fields(record: &PairRecord) -> Option<Value> {
    let metric = &record.metrics[chosen(&record.metrics)?];
    let fields = SampleFields {
        pair: &record.pair,
        metric,
        metrics: &record.metrics,
    };
    Some(serde_json::to_value(&fields).expect("a record is JSON"))
}

/// Returns the JSON Schema of the fields of a sample.
pub(super) fn schema() -> Value {
    schema_of::<SampleFields<'_>>()
}

/// Returns whether a file is 8-bit grey or RGB without transparency, which all programs show alike.
fn is_plain(file: &[u8], extension: &str) -> bool {
    match extension {
        "jpg" => true,
        // Bytes 24 and 25 of a PNG are the bits per sample and the colour type: 0 is grey, 2 is RGB.
        "png" => {
            matches!(file.get(24..26), Some([8, 0 | 2]))
                && !file.windows(4).any(|chunk| chunk == b"tRNS")
        }
        _ => false,
    }
}

/// Draws the pictures of a sample under one metric. The print is the original file if it is PNG or JPEG of 8 bits and
/// `keep_print`, otherwise an 8-bit PNG.
pub(super) fn pictures(
    result: &PairPictures<'_>,
    record: &MetricRecord,
    keep_print: bool,
) -> Result<Vec<SamplePicture>, PictureError> {
    let outcome = &record.outcome;
    let (mut print, mut extension) = (Vec::new(), "png");
    if keep_print {
        (print, extension) = result.print_file()?;
    }
    if !keep_print || !is_plain(&print, extension) {
        (print, extension) = (png_rgb8(&result.print_rgb()?), "png");
    }
    let files = [
        print,
        png_mask(&result.print_mask()?),
        result.depth_file()?.into_owned(),
        png_grey16(&result.aligned_depth(outcome)?),
        png_mask(result.aligned_mask(outcome)?.as_ref()),
    ];
    let files = PICTURES.into_iter().zip(files).enumerate();
    let pictures = files.map(|(i, (name, bytes))| SamplePicture {
        name,
        extension: if i == 0 { extension } else { "png" },
        bytes,
    });
    Ok(pictures.collect())
}

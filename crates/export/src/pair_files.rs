//! The picture files of a pair. Pictures that several metrics share are written once.

use schemars::JsonSchema;
use serde::Serialize;

use super::format_writer::EncodedPair;
use super::pair_pictures::{PairPictures, PictureError};
use mocban_catalog::MetricRecord;
use mocban_core::domain::artifact_role::{CANVAS_PRINT_MASK, canvas_depth_mask, stroke_map};
use mocban_core::domain::{
    DepthScale, LengthUnit, Levelling, MetricOutcome, PairName, Stage, ThresholdMetric,
};
use mocban_core::raster::{compact_rgb8, png_grey16, png_mask};
use mocban_results::pair_artifacts::same_alignment;

/// Folder of the files of a pair; `*` stands for its id.
const PAIR: &str = "pairs/*";

/// Files of one line, as paths below the folder of the format. Masks are 8-bit PNG images in which 255 is stroke.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub(super) struct Files {
    /// The print image: the original file, or a PNG if it was turned upright or warped to a canvas.
    pub(super) print: String,
    /// Ink mask of the print.
    pub(super) print_mask: String,
    /// Depth map, 16 bits: 0 = no data, 1 to 65535 linear in height. `depth.json` beside it holds the scale.
    pub(super) depth: String,
    /// Strokes at this metric's threshold.
    pub(super) depth_mask: String,
    /// The depth map warped onto the print; a level means the same height as in `depth`.
    pub(super) aligned_depth: String,
    /// The strokes warped onto the print.
    pub(super) aligned_mask: String,
    /// The strokes on the canvas from which the scores were computed.
    pub(super) canvas_depth_mask: String,
    /// The ink mask on that canvas.
    pub(super) canvas_print_mask: String,
    /// Where the canvas masks disagree: 128 = stroke without ink, 255 = ink without wood, 0 = elsewhere.
    pub(super) stroke_map: String,
    /// The print with the edges of the strokes, enlarged if it is small. On a displaced part, they are blue and at its own
    /// pose.
    pub(super) overlay: String,
}

impl Files {
    /// Returns the paths of a pair: replaces `*` by the file name of its id.
    pub(super) fn of_pair(self, id: &PairName) -> Self {
        let path = |pattern: String| pattern.replace('*', &id.file_name());
        Self {
            print: path(self.print),
            print_mask: path(self.print_mask),
            depth: path(self.depth),
            depth_mask: path(self.depth_mask),
            aligned_depth: path(self.aligned_depth),
            aligned_mask: path(self.aligned_mask),
            canvas_depth_mask: path(self.canvas_depth_mask),
            canvas_print_mask: path(self.canvas_print_mask),
            stroke_map: path(self.stroke_map),
            overlay: path(self.overlay),
        }
    }
}

/// The meaning of a depth PNG's levels; written next to it as `depth.json`.
#[derive(Debug, Serialize)]
struct DepthSidecar<'a> {
    /// Level of pixels without data.
    no_data: u16,
    #[serde(flatten)]
    scale: &'a DepthScale,
    /// `[c0, cx, cy, cxx, cxy, cyy]`: the curved surface over the plane, all zero for a flat block.
    curvature: [f64; 6],
    /// Millimetres per mesh unit, where the unit is known.
    mm_per_mesh_unit: Option<f64>,
    /// Heights over the curved surface that were subtracted, if the map was levelled.
    #[serde(skip_serializing_if = "Option::is_none")]
    levelling: Option<&'a Levelling>,
}

/// Encodes the files of a finished pair. Returns the patterns of each selected metric.
pub(super) fn write_files(
    pictures: &PairPictures<'_>,
    encoded: &mut EncodedPair,
) -> Result<Vec<Files>, PictureError> {
    let shared = |name: &str| format!("{PAIR}/{name}");
    let (print, extension) = pictures.print_file()?;
    let print_name = shared(&format!("print.{extension}"));
    encoded.add_file(&print_name, print);
    encoded.add_file(shared("print_mask.png"), png_mask(&pictures.print_mask()?));
    encoded.add_file(shared("depth.png"), pictures.depth_file()?);
    encoded.add_file(
        shared("depth.json"),
        sidecar(
            &pictures.outcomes.depth.scale,
            pictures.outcomes.register.levelling.as_ref(),
        )
        .into_bytes(),
    );
    let canvas = pictures.stored_file(Stage::Register, CANVAS_PRINT_MASK)?;
    encoded.add_file(shared("canvas_print_mask.png"), canvas);

    let mut each = EachMetric { pictures, encoded };
    let same_level = |a: &MetricOutcome, b: &MetricOutcome| a.threshold_level == b.threshold_level;
    let same_pose = |a: &MetricOutcome, b: &MetricOutcome| a.print_from_depth == b.print_from_depth;
    let depth_masks = each.add("depth_mask", same_level, |metric| {
        Ok(png_mask(&pictures.depth_mask(metric)?))
    })?;
    let aligned_depths = each.add("aligned_depth", same_pose, |metric| {
        Ok(png_grey16(&pictures.aligned_depth(metric)?))
    })?;
    let aligned_masks = each.add("aligned_mask", same_alignment, |metric| {
        Ok(png_mask(pictures.aligned_mask(metric)?.as_ref()))
    })?;
    let overlays = each.add("overlay", same_alignment, |metric| {
        Ok(compact_rgb8(&pictures.overlay(metric)?))
    })?;
    let canvas_masks = each.add_artifact("canvas_depth_mask", canvas_depth_mask)?;
    let stroke_maps = each.add_artifact("stroke_map", stroke_map)?;
    let files = (0..pictures.metrics.len()).map(|i| Files {
        print: print_name.clone(),
        print_mask: shared("print_mask.png"),
        depth: shared("depth.png"),
        depth_mask: depth_masks[i].clone(),
        aligned_depth: aligned_depths[i].clone(),
        aligned_mask: aligned_masks[i].clone(),
        canvas_depth_mask: canvas_masks[i].clone(),
        canvas_print_mask: shared("canvas_print_mask.png"),
        stroke_map: stroke_maps[i].clone(),
        overlay: overlays[i].clone(),
    });
    Ok(files.collect())
}

/// Adds the pictures that may differ from metric to metric.
struct EachMetric<'a, 'b> {
    pictures: &'a PairPictures<'b>,
    encoded: &'a mut EncodedPair,
}

impl EachMetric<'_, '_> {
    /// Adds one file for each group of metrics with the same picture. Returns the pattern of each metric.
    fn add(
        &mut self,
        name: &str,
        is_same: impl Fn(&MetricOutcome, &MetricOutcome) -> bool,
        draw: impl Fn(&MetricOutcome) -> Result<Vec<u8>, PictureError>,
    ) -> Result<Vec<String>, PictureError> {
        let outcomes: Vec<_> = self
            .pictures
            .metrics
            .iter()
            .map(|record| &record.outcome)
            .collect();
        let first = first_of_each(&outcomes, |a, b| is_same(a, b));
        self.add_groups(name, &first, |i| draw(outcomes[i]))
    }

    /// Adds a stored picture of each metric; equal ones are written once.
    fn add_artifact(
        &mut self,
        name: &str,
        role: impl Fn(ThresholdMetric) -> String,
    ) -> Result<Vec<String>, PictureError> {
        let pictures = self.pictures;
        let artifacts = pictures.metrics.iter().map(|record: &&MetricRecord| {
            pictures.artifact(Stage::Register, &role(record.outcome.metric))
        });
        let artifacts: Vec<_> = artifacts.collect::<Result<_, _>>()?;
        let first = first_of_each(&artifacts, |a, b| a.hash == b.hash);
        self.add_groups(name, &first, |i| {
            let role = role(pictures.metrics[i].outcome.metric);
            pictures.stored_file(Stage::Register, &role)
        })
    }

    /// Adds the file of each group, given the first member of each metric's group.
    fn add_groups(
        &mut self,
        name: &str,
        first: &[usize],
        draw: impl Fn(usize) -> Result<Vec<u8>, PictureError>,
    ) -> Result<Vec<String>, PictureError> {
        let is_shared = first.iter().all(|index| *index == 0);
        let pattern = |index: usize| {
            if is_shared {
                return format!("{PAIR}/{name}.png");
            }
            let metric = self.pictures.metrics[index].outcome.metric;
            format!("{PAIR}/{metric}/{name}.png")
        };
        let patterns: Vec<String> = first.iter().map(|index| pattern(*index)).collect();
        for (i, index) in first.iter().enumerate() {
            if i == *index {
                self.encoded.add_file(&patterns[i], draw(i)?);
            }
        }
        Ok(patterns)
    }
}

/// Returns for each item the index of the first item that is the same.
fn first_of_each<T>(items: &[T], is_same: impl Fn(&T, &T) -> bool) -> Vec<usize> {
    let first = |item| items.iter().position(|earlier| is_same(earlier, item));
    let found = items
        .iter()
        .enumerate()
        .map(|(i, item)| first(item).unwrap_or(i));
    found.collect()
}

/// Returns the text of the file beside a depth map that gives its scale.
pub(super) fn sidecar(scale: &DepthScale, levelling: Option<&Levelling>) -> String {
    let sidecar = DepthSidecar {
        no_data: 0,
        scale,
        curvature: scale.curvature.map_or([0.0; 6], |curvature| curvature.0),
        mm_per_mesh_unit: scale.unit.map(LengthUnit::mm),
        levelling,
    };
    let text = serde_json::to_string_pretty(&sidecar)
        .expect("a scale holds only numbers, lists and names");
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::first_of_each;

    #[test]
    fn equal_items_share_the_first() {
        let same = |a: &i32, b: &i32| a == b;
        assert_eq!(first_of_each(&[7, 7, 7], same), [0, 0, 0]);
        assert_eq!(first_of_each(&[7, 8, 7, 8], same), [0, 1, 0, 1]);
        assert!(first_of_each(&[], same).is_empty());
    }
}

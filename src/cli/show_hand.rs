//! What `show` tells of alignments by hand.

use serde::Serialize;

use super::output::Palette;
use super::show_text::heading;
use super::time_text::utc;
use crate::catalog::{Catalog, CatalogError, PairResults, StoredAlignment};
use crate::domain::{DepthOutcome, MetricOutcome, Stage, ThresholdMetric};
use crate::report::ManualCorrection;

/// An alignment by hand beside the automatic result.
#[derive(Debug, Serialize)]
pub(super) struct Laid {
    #[serde(flatten)]
    stored: StoredAlignment,
    /// What was done to the automatic result; null where that is on another depth map.
    moved: Option<Moved>,
}

/// What was done to one metric's result.
#[derive(Debug, Serialize)]
struct Moved {
    from: ThresholdMetric,
    #[serde(flatten)]
    by: ManualCorrection,
    /// The result's own agreement of masks.
    from_iou: f64,
}

/// The alignments by hand of a pair that were not taken back, oldest first.
///
/// # Errors
/// When the catalog refuses.
pub(super) async fn of(
    catalog: &Catalog,
    results: &PairResults,
) -> Result<Vec<Laid>, CatalogError> {
    let stored = catalog.manual_alignments().await?.into_iter();
    let ours =
        stored.filter(|laid| laid.made.pair == results.facts.name && laid.undone_at.is_none());
    Ok(ours
        .map(|stored| Laid {
            moved: moved(&stored, results),
            stored,
        })
        .collect())
}

fn moved(laid: &StoredAlignment, results: &PairResults) -> Option<Moved> {
    let from = automatic(results).filter(|_| laid.on_current_depth)?;
    let depth: DepthOutcome = results.stage(Stage::Depth)?.parse().ok()?;
    let size = [depth.width, depth.height];
    let by = ManualCorrection::between(&from.print_from_depth, &laid.made.print_from_depth, size)?;
    Some(Moved {
        from: from.metric,
        by,
        from_iou: from.scores.iou,
    })
}

/// The result to tell it against: the ensemble's, or the first.
fn automatic(results: &PairResults) -> Option<&MetricOutcome> {
    let found = results.metric(ThresholdMetric::Ensemble);
    found
        .or(results.metrics.first())
        .map(|record| &record.outcome)
}

/// The alignments as lines; nothing where there are none.
pub(super) fn text(laid: &[Laid], palette: Palette) -> String {
    if laid.is_empty() {
        return String::new();
    }
    let lines: Vec<String> = laid.iter().map(line).collect();
    format!("{}{}", heading("by hand", palette), lines.concat())
}

/// `  2026-11-22 02:10:00  lan: turned 5.0°, shifted 12.1 px, scaled 1.000 from ensemble; IoU 0.616, before 0.702`
fn line(laid: &Laid) -> String {
    let made = &laid.stored.made;
    let mut words = format!("  {}  {}: ", utc(laid.stored.at), made.reviewer);
    words.push_str(&match &laid.moved {
        Some(moved) => deed(moved, made.iou),
        None if laid.stored.holds => "laid on an earlier depth map".to_owned(),
        None => "laid for another mesh or print".to_owned(),
    });
    let note = made.note.as_deref().map(|note| format!(" ({note})"));
    words.push_str(&note.unwrap_or_default());
    words.push('\n');
    words
}

fn deed(moved: &Moved, iou: f64) -> String {
    let ManualCorrection {
        turned_deg,
        shifted_px: [x, y],
        scaled,
        mirrored,
    } = moved.by;
    // No -0.0 where nothing was turned.
    let turned_deg = (turned_deg * 10.0).round() / 10.0 + 0.0;
    let mirrored = if mirrored { ", mirrored" } else { "" };
    format!(
        "turned {turned_deg:.1}\u{b0}, shifted {:.1} px, scaled {scaled:.3}{mirrored} from {}; IoU {iou:.3}, before {:.3}",
        x.hypot(y),
        moved.from,
        moved.from_iou
    )
}

#[cfg(test)]
mod tests {
    use super::{ManualCorrection, Moved, deed};
    use crate::domain::ThresholdMetric;

    #[test]
    fn a_correction_is_one_line() {
        let moved = Moved {
            from: ThresholdMetric::Ensemble,
            by: ManualCorrection {
                turned_deg: -5.04,
                shifted_px: [3.0, 4.0],
                scaled: 1.0,
                mirrored: true,
            },
            from_iou: 0.7021,
        };
        assert_eq!(
            deed(&moved, 0.616),
            "turned -5.0\u{b0}, shifted 5.0 px, scaled 1.000, mirrored from ensemble; IoU 0.616, before 0.702"
        );
    }
}

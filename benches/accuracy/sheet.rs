//! Contact sheets of the worst pairs of each tier and method.

use std::path::Path;

use anyhow::Context as _;
use mocban::demo::Tier;
use mocban::domain::ThresholdMetric;
use mocban::export::pictures::{
    ContactSheetCell, FrameKind, PrintView, Rgb, SheetLegend, contact_sheet, tile_side,
};
use mocban::raster::{Grid, PrintImage, png_rgb8};

use super::method::Method;
use super::options::Options;
use super::run::Run;
use super::trial::{Trial, of};
use super::workers::in_order;

/// Pairs in a row.
const COLUMNS: usize = 4;
/// A pixel of a tops mask that is a true stroke top.
const TOP: u8 = 255;

/// Draws a sheet for each tier and method. For each pair it shows the print, the aligned relief, and the print with
/// outlines: blue around the true stroke tops, vermillion around the depth mask.
pub(super) fn write(
    dir: &Path,
    options: &Options,
    methods: &[Method],
    trials: &[Trial],
) -> anyhow::Result<()> {
    std::fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
    for tier in &options.tiers {
        for method in methods {
            let sheet = draw(&worst(trials, *tier, method, options), method, options)?;
            let path = dir.join(format!("{tier}-{}.png", method.name));
            std::fs::write(&path, png_rgb8(&sheet)).with_context(|| path.display().to_string())?;
        }
    }
    Ok(())
}

/// Returns the trials of a sheet: first the failed trials, then the trials farthest from the truth.
fn worst<'a>(
    trials: &'a [Trial],
    tier: Tier,
    method: &Method,
    options: &Options,
) -> Vec<&'a Trial> {
    let mut worst = of(trials, tier, method);
    worst.sort_by(|a, b| {
        b.severity(options.metric)
            .total_cmp(&a.severity(options.metric))
    });
    worst.truncate(options.worst);
    worst
}

/// The few pairs on the sheet are run again, because images are not kept while all pairs run.
fn draw(worst: &[&Trial], method: &Method, options: &Options) -> anyhow::Result<Rgb> {
    let side = tile_side(COLUMNS, worst.len());
    let cells = in_order(worst.len(), options.workers, |index| {
        let trial = worst[index];
        let (pair, input) = trial.case.make()?;
        let run = Run::new(&input, &method.settings);
        Ok(ContactSheetCell {
            id: format!("{} seed {}", pair.id, trial.case.seed),
            note: note(trial, options.metric),
            character: None,
            state: Vec::new(),
            frame: if trial.severity(options.metric) > 1.0 {
                FrameKind::Wrong
            } else {
                FrameKind::Other
            },
            tiles: tiles(&run, &pair.tops, &input.print, options.metric, side),
        })
    })?;
    let legend = SheetLegend {
        title: format!("{}: {} pairs, worst first", method.name, worst.len()),
        explanation: "Blue: true stroke tops. Orange: stroke edges of the relief.".to_owned(),
    };
    Ok(contact_sheet(&cells, COLUMNS, &legend))
}

/// Returns the errors, or the reason for a failure.
fn note(trial: &Trial, metric: ThresholdMetric) -> String {
    match (&trial.outcome, trial.found(metric)) {
        (Ok(_), Some(found)) => {
            let (errors, normal) = (found.errors, trial.normal_deg.unwrap_or_default());
            let (angle, landmarks) = (errors.angle_deg, errors.tre_pct);
            let tops = errors.mask_iou.unwrap_or_default();
            format!("{angle:.1}\u{b0} {landmarks:.1}% tops {tops:.2} n {normal:.1}\u{b0}")
        }
        (Err(why), _) => why.clone(),
        (Ok(_), None) => format!("there is no row {metric}"),
    }
}

fn tiles(
    run: &Run,
    tops: &Grid<u8>,
    print: &[u8],
    metric: ThresholdMetric,
    side: usize,
) -> [Option<Rgb>; 3] {
    let decode =
        |bytes| mocban::raster::decode(bytes, &mocban::raster::ImageLimits::SUGGESTED).ok();
    let Ok((print, aligned)) = &run.result else {
        let plain = |print: PrintImage| PrintView::of_side(&print, side).print(&print);
        return [decode(print).map(plain), None, None];
    };
    let view = PrintView::of_side(print.image(), side);
    let plain = Some(view.print(print.image()));
    let Some(found) = aligned.metric(metric) else {
        return [plain, None, None];
    };
    let tops = tops.map(|value| *value == TOP);
    let relief = view.relief(&aligned.depth, &found.print_from_depth);
    let overlay = view.overlay_on_truth(print.image(), &tops, &aligned.depth, found);
    [plain, Some(relief), Some(overlay)]
}

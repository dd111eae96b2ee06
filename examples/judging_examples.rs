//! Draws the example pictures of the review page, `assets/review/examples/`, from two demo projects:
//!
//! ```sh
//! mocban demo /tmp/pose --tier pose --pairs 12 --seed 77
//! mocban demo /tmp/worn --tier worn --pairs 12 --seed 77
//! cargo run --release --example judging_examples -- /tmp/pose /tmp/worn
//! ```

use std::error::Error;
use std::path::{Path, PathBuf};

use mocban::catalog::{Catalog, PairResults};
use mocban::domain::{Affine2, MetricOutcome, PairName, ThresholdMetric};
use mocban::export::SourcePrint;
use mocban::export::pictures::PrintView;
use mocban::raster::{DepthMap, ImageLimits, jpeg_rgb8, png_grey8, png_mask};
use mocban::results::pair_artifacts::PairArtifacts;
use mocban::stages::normalize::PrintMasks;
use mocban::stages::register::StrokeMap;
use mocban::store::Project;

/// Longer side of the pictures, pixels.
const SIDE: usize = 360;
/// Quality of the JPEG pictures of print and relief.
const QUALITY: u8 = 82;

/// How the relief of an example differs from the result.
#[derive(Debug, Clone, Copy)]
enum Fault {
    None,
    Rotated {
        degrees: f64,
    },
    /// The stroke area is multiplied by this factor.
    StrokeArea(f64),
    /// Moved by shares of the width of the relief, and scaled.
    Moved {
        right: f64,
        scale: f64,
    },
    /// Left and right of the print are swapped.
    Mirrored,
    /// The relief of another pair of the project.
    OtherRelief(&'static str),
}

/// Name, project, pair and fault of each example.
const EXAMPLES: [(&str, usize, &str, Fault); 9] = [
    ("complete", 0, "pose-0003", Fault::None),
    ("worn", 1, "worn-0009", Fault::None),
    ("frame_line", 0, "pose-0002", Fault::None),
    ("angle", 0, "pose-0001", Fault::Rotated { degrees: 9.0 }),
    ("strokes_lost", 0, "pose-0008", Fault::StrokeArea(0.5)),
    ("background_in", 0, "pose-0007", Fault::StrokeArea(1.9)),
    (
        "shift_or_scale",
        0,
        "pose-0006",
        Fault::Moved {
            right: 0.09,
            scale: 0.86,
        },
    ),
    ("mirrored", 0, "pose-0005", Fault::Mirrored),
    (
        "wrong_pair",
        0,
        "pose-0000",
        Fault::OtherRelief("pose-0011"),
    ),
];

/// A finished pair and its result.
struct Aligned {
    project: Project,
    pair: PairResults,
    depth: DepthMap,
    outcome: MetricOutcome,
}

impl Aligned {
    async fn read(dir: &Path, name: &str) -> Result<Self, Box<dyn Error>> {
        let project = Project::open(dir)?;
        let catalog = Catalog::open_read_only(&project.catalog_path()).await?;
        let detail = catalog.pair(&PairName::new(name)?).await?;
        catalog.close().await;
        let pair = detail
            .ok_or_else(|| format!("{}: no pair {name}", dir.display()))?
            .results;
        let depth = PairArtifacts::new(&project, &pair).depth()?;
        let is_relief = |metric: &ThresholdMetric| *metric == ThresholdMetric::Relief;
        let record = pair
            .metrics
            .iter()
            .find(|record| is_relief(&record.outcome.metric));
        let outcome = record
            .ok_or_else(|| format!("{name} is not aligned"))?
            .outcome;
        Ok(Self {
            project,
            pair,
            depth,
            outcome,
        })
    }

    /// Returns the centre of the depth map on the print.
    fn centre(&self, map: &Affine2) -> [f64; 2] {
        let (width, height) = (self.depth.levels.width(), self.depth.levels.height());
        map.apply([(width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0])
    }

    /// Returns the threshold at which the stroke area is multiplied by `factor`.
    fn level_of_area(&self, factor: f64) -> u16 {
        let mut levels = self.depth.valid_levels();
        levels.sort_unstable_by(|a, b| b.cmp(a));
        let area = levels.partition_point(|level| *level >= self.outcome.threshold_level);
        levels[((area as f64 * factor) as usize).min(levels.len() - 1)]
    }
}

/// Returns the relief with its threshold and place on the print.
async fn relief(
    dir: &Path,
    pair: &Aligned,
    fault: Fault,
) -> Result<(DepthMap, u16, Affine2), Box<dyn Error>> {
    let (depth, level) = (pair.depth.clone(), pair.outcome.threshold_level);
    let map = pair.outcome.print_from_depth;
    let centre = pair.centre(&map);
    let to_origin = Affine2::scale_shift(1.0, centre.map(|c| -c));
    let about_centre = |scale: f64, degrees: f64, [x, y]: [f64; 2]| {
        let place =
            Affine2::similarity(scale, degrees.to_radians(), [centre[0] + x, centre[1] + y]);
        place.after(&to_origin).after(&map)
    };
    Ok(match fault {
        Fault::None => (depth, level, map),
        Fault::Rotated { degrees } => (depth, level, about_centre(1.0, degrees, [0.0; 2])),
        Fault::StrokeArea(factor) => (depth, pair.level_of_area(factor), map),
        Fault::Moved { right, scale } => {
            let width = map.scale() * depth.levels.width() as f64;
            (depth, level, about_centre(scale, 0.0, [right * width, 0.0]))
        }
        Fault::Mirrored => {
            let flip = Affine2([[-1.0, 0.0, 2.0 * centre[0]], [0.0, 1.0, 0.0]]);
            (depth, level, flip.after(&map))
        }
        Fault::OtherRelief(name) => {
            let other = Aligned::read(dir, name).await?;
            let own = other.outcome.print_from_depth;
            let from = other.centre(&own);
            let shift = Affine2::scale_shift(1.0, [centre[0] - from[0], centre[1] - from[1]]);
            (
                other.depth.clone(),
                other.outcome.threshold_level,
                shift.after(&own),
            )
        }
    })
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let dirs: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [_, _] = dirs.as_slice() else {
        return Err("usage: judging_examples POSE_PROJECT WORN_PROJECT".into());
    };
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/review/examples");
    for (name, project, pair, fault) in EXAMPLES {
        let dir = &dirs[project];
        let pair = Aligned::read(dir, pair).await?;
        let (depth, level, map) = relief(dir, &pair, fault).await?;
        let artifacts = PairArtifacts::new(&pair.project, &pair.pair);
        let print = SourcePrint::read(&pair.project, &pair.pair, &ImageLimits::SUGGESTED)?.picture;
        let masks = PrintMasks::from_grey(&artifacts.print_grey()?, artifacts.mask_scale()?);
        let view = PrintView::of_side(&print, SIDE);
        let folder = target.join(name);
        std::fs::create_dir_all(&folder)?;
        let strokes = depth.stroke_mask(level);
        let files = [
            ("print.jpg", jpeg_rgb8(&view.print(&print), QUALITY)),
            ("relief.jpg", jpeg_rgb8(&view.relief(&depth, &map), QUALITY)),
            (
                "print-mask.png",
                png_mask(&view.mask(&masks.ink_of_print(), &Affine2::IDENTITY)),
            ),
            ("depth-mask.png", png_mask(&view.mask(&strokes, &map))),
            (
                "stroke-map.png",
                stroke_map(&view, &pair, &depth, &masks, &map, level)?,
            ),
        ];
        for (file, bytes) in files {
            std::fs::write(folder.join(file), bytes)?;
        }
    }
    Ok(())
}

/// Draws where relief and ink disagree, as the review page does.
fn stroke_map(
    view: &PrintView,
    pair: &Aligned,
    depth: &DepthMap,
    masks: &PrintMasks,
    map: &Affine2,
    level: u16,
) -> Result<Vec<u8>, Box<dyn Error>> {
    let artifacts = PairArtifacts::new(&pair.project, &pair.pair);
    let canvas_from_print = artifacts.canvas_from_print()?;
    let side = artifacts.canvas_print_mask()?.width() as u32;
    let found = StrokeMap::of_alignment(depth, masks, &canvas_from_print, map, side, level);
    let print_from_canvas = canvas_from_print.inverse().unwrap_or(Affine2::IDENTITY);
    let drawn = view.labels(&found.grey, StrokeMap::DISAGREEMENTS, &print_from_canvas);
    Ok(png_grey8(&drawn))
}

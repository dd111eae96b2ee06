//! Marks on a sheet that were not printed from the block: stamps, blots, and a tear along the fold.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::page_appearance::AppearanceRanges;
use crate::draw::number_within;
use crate::ellipse::{Axis, Ellipse};
use crate::noise::{Noise, smoothstep};
use crate::polygon::BoundsMm;

/// Marks on a sheet, in the page's plane.
#[derive(Debug, Clone, Default)]
pub(super) struct PageMarks {
    stamps: Vec<Stamp>,
    blots: Vec<Blot>,
    tear: Option<Tear>,
}

/// Colour of a mark, 0..=255 per channel, and its density, 0..=1.
type Mark = ([f64; 3], f64);

/// A square seal with a frame and strokes like those of seal script.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    centre: [f64; 2],
    axis: Axis,
    half_mm: f64,
    /// Width of the strokes and distance of their middles, mm.
    stroke_mm: f64,
    pitch_mm: f64,
    strokes: Noise,
    cover: Noise,
    colour: [f64; 3],
    density: f64,
    /// Whether the strokes are white on the colour.
    is_white: bool,
}

/// A drop or a smear of ink or dirt.
#[derive(Debug, Clone, Copy)]
struct Blot {
    shape: Ellipse,
    edge: Noise,
    colour: [f64; 3],
    density: f64,
}

/// A dark, ragged line where the sheet is torn at its fold.
#[derive(Debug, Clone, Copy)]
struct Tear {
    u: f64,
    course: Noise,
    width: Noise,
    half_mm: f64,
    /// Values of the width's noise below which the sheet holds together.
    whole_below: f64,
    density: f64,
}

impl PageMarks {
    /// Draws the marks on a sheet whose text lies in a box.
    pub(super) fn draw(ranges: &AppearanceRanges, text: BoundsMm, rng: &mut ChaCha8Rng) -> Self {
        let stamps = number_within(ranges.stamps, rng);
        let blots = number_within(ranges.blots, rng);
        let is_torn = rng.random_bool(ranges.torn_fold);
        Self {
            stamps: (0..stamps).map(|_| Stamp::draw(text, rng)).collect(),
            blots: (0..blots).map(|_| Blot::draw(text, rng)).collect(),
            tear: is_torn.then(|| Tear::draw(text, rng)),
        }
    }

    /// Returns the densest mark at a point; `None` on a clean place.
    pub(super) fn at(&self, point: [f64; 2]) -> Option<Mark> {
        let stamps = self.stamps.iter().map(|stamp| stamp.at(point));
        let blots = self.blots.iter().map(|blot| blot.at(point));
        let tear = self.tear.iter().map(|tear| tear.at(point));
        let marks = stamps.chain(blots).chain(tear);
        marks
            .filter(|(_, density)| *density > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Draws a point in a box or up to 8 mm around it.
fn near(text: BoundsMm, rng: &mut ChaCha8Rng) -> [f64; 2] {
    let area = text.with_margin(8.0);
    [0, 1].map(|i| rng.random_range(area.min[i]..area.max[i]))
}

impl Stamp {
    fn draw(text: BoundsMm, rng: &mut ChaCha8Rng) -> Self {
        let stroke_mm = rng.random_range(0.6..1.6);
        let is_red = rng.random_bool(0.8);
        Self {
            centre: near(text, rng),
            axis: Axis::at(rng.random_range(-0.15..0.15)),
            half_mm: rng.random_range(6.0..20.0),
            stroke_mm,
            pitch_mm: stroke_mm * rng.random_range(1.7..2.6),
            strokes: Noise::draw(rng),
            cover: Noise::draw(rng),
            colour: if is_red {
                [
                    rng.random_range(150.0..215.0),
                    rng.random_range(30.0..90.0),
                    rng.random_range(25.0..80.0),
                ]
            } else {
                [rng.random_range(20.0..60.0); 3]
            },
            density: rng.random_range(0.35..0.95),
            is_white: rng.random_bool(0.3),
        }
    }

    fn at(&self, point: [f64; 2]) -> Mark {
        let offset = [0, 1].map(|i| point[i] - self.centre[i]);
        let [x, y] = self.axis.along_across(offset);
        let inside = self.half_mm - x.abs().max(y.abs());
        if inside <= 0.0 {
            return (self.colour, 0.0);
        }
        let is_frame = inside < self.stroke_mm;
        let line = |a: f64, b: f64, salt: f64| {
            let number = (a / self.pitch_mm).round();
            let from_middle = (a - number * self.pitch_mm).abs();
            // Strokes end where the noise of their line changes its sign.
            from_middle < self.stroke_mm / 2.0
                && self
                    .strokes
                    .at(number * 3.7 + salt, b / (3.0 * self.pitch_mm))
                    > 0.0
        };
        let is_stroke = inside > 1.8 * self.stroke_mm && (line(x, y, 0.0) || line(y, x, 50.0));
        let is_coloured = is_frame || (is_stroke != self.is_white);
        let uneven = 0.7 + 0.3 * self.cover.two_octaves(x / 2.0, y / 2.0);
        let density = if is_coloured {
            (self.density * uneven).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (self.colour, density)
    }
}

impl Blot {
    fn draw(text: BoundsMm, rng: &mut ChaCha8Rng) -> Self {
        let long_mm = 0.5 * 24.0_f64.powf(rng.random());
        let grey = rng.random_range(15.0..90.0);
        Self {
            shape: Ellipse {
                centre: near(text, rng),
                axis: Axis::draw_any(rng),
                long_mm,
                short_mm: long_mm * rng.random_range(0.12..0.9),
            },
            edge: Noise::draw(rng),
            colour: [grey + 12.0, grey, grey * 0.8],
            density: rng.random_range(0.25..0.95),
        }
    }

    fn at(&self, [u, v]: [f64; 2]) -> Mark {
        let [du, dv] = [u - self.shape.centre[0], v - self.shape.centre[1]];
        let reach = self.shape.long_mm + 2.0;
        if du * du + dv * dv > reach * reach {
            return (self.colour, 0.0);
        }
        let rough = 0.35 * self.edge.two_octaves(u / 0.8, v / 0.8);
        let inside = self.shape.inside_mm([u, v]) + rough;
        (self.colour, self.density * smoothstep(-0.1, 0.25, inside))
    }
}

impl Tear {
    fn draw(text: BoundsMm, rng: &mut ChaCha8Rng) -> Self {
        let middle = f64::midpoint(text.min[0], text.max[0]);
        Self {
            u: middle + rng.random_range(-12.0..12.0),
            course: Noise::draw(rng),
            width: Noise::draw(rng),
            half_mm: rng.random_range(0.15..0.7),
            whole_below: rng.random_range(-0.9..0.2),
            density: rng.random_range(0.4..0.95),
        }
    }

    fn at(&self, [u, v]: [f64; 2]) -> Mark {
        const COLOUR: [f64; 3] = [52.0, 44.0, 36.0];
        let course =
            0.9 * self.course.two_octaves(v / 40.0, 0.0) + 0.2 * self.course.at(v / 1.3, 5.0);
        let width = self.width.two_octaves(v / 18.0, 2.0) - self.whole_below;
        let half = self.half_mm * (2.0 * width).clamp(0.0, 1.0);
        let inside = half - (u - self.u - course).abs();
        (COLOUR, self.density * smoothstep(-0.02, 0.08, inside))
    }
}

#[cfg(test)]
mod tests {
    use super::PageMarks;
    use crate::block::kind::BlockKind;
    use crate::block::seeding::part_rng;
    use crate::polygon::BoundsMm;

    #[test]
    fn marks_cover_a_part_of_a_stamped_page_and_nothing_of_a_clean_one() {
        let text = BoundsMm {
            min: [-140.0, -100.0],
            max: [140.0, 100.0],
        };
        let covered = |kind: BlockKind, seed: u64| {
            let marks = PageMarks::draw(&kind.ranges().appearance, text, &mut part_rng(seed, 0));
            let points =
                (-140..140).flat_map(|u| (-100..100).map(move |v| [f64::from(u), f64::from(v)]));
            points.filter(|point| marks.at(*point).is_some()).count()
        };
        for seed in 0..6 {
            assert_eq!(covered(BlockKind::Plain, seed), 0);
        }
        let stamped: usize = (0..6).map(|seed| covered(BlockKind::Stamped, seed)).sum();
        assert!((1_000..120_000).contains(&stamped), "{stamped}");
    }
}

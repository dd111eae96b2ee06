//! Frame and rules between columns, and other marks that are no text.

use super::text_image::PIXEL_MM;
use mocban_core::raster::components::ConnectedComponents;
use mocban_core::raster::{Grid, Mask};

/// Length over which a rule is straight and nearly without gaps, mm, and the fraction of it that is covered.
const RULE_MM: f64 = 25.0;
const RULE_COVER: f64 = 0.9;
/// Least length of all parts of a rule, mm.
const LINE_MM: f64 = 40.0;
/// Least length of all parts of a rule, in relation to the longest rule. Strokes of a few characters may lie in line.
const LINE_SHARE: f64 = 0.35;
/// A rule may be broken into short parts: length over which a part is nearly without gaps, mm; least length of all parts, in
/// relation to the height of the text; largest width across all parts, mm. Strokes of characters are shorter.
const PART_MM: f64 = 12.0;
const PARTS_SHARE: f64 = 0.4;
const PARTS_WIDTH_MM: f64 = 1.5;
/// Wanderings of a rule across its direction, mm.
const LINE_SPREAD_MM: f64 = 0.6;
/// Width of the strokes beside the middle of a rule that belong to it, mm.
const THIN_MM: f64 = 0.75;

/// Least fraction of an ornament that is solid.
const ORNAMENT_SHARE: f64 = 0.4;

/// A straight rule along y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rule {
    /// Position of its middle across, pixels.
    pub(super) at: f64,
    /// Outermost positions of its edges across, pixels.
    pub(super) edges: [f64; 2],
    /// Length of its parts, pixels.
    pub(super) length: usize,
}

/// Finds the rules along y and erases them. Rules along x are found in the transposed mask.
pub(super) fn take_rules(strokes: &mut Mask, erased: &mut Mask) -> Vec<Rule> {
    let found = long_runs(strokes, RULE_MM);
    let mut rules = group(&found);
    let longest = rules.iter().map(|rule| rule.length).max().unwrap_or(0);
    rules.retain(|rule| rule.length as f64 >= LINE_SHARE * longest as f64);
    for rule in &rules {
        erase_thin(strokes, erased, rule);
    }
    let parts = long_runs(strokes, PART_MM);
    let broken = group(&parts).into_iter();
    let least = PARTS_SHARE * strokes.height() as f64;
    let is_rule = |rule: &Rule| {
        rule.length as f64 >= least && rule.edges[1] - rule.edges[0] <= PARTS_WIDTH_MM / PIXEL_MM
    };
    for rule in broken.filter(is_rule) {
        erase_thin(strokes, erased, &rule);
        rules.push(rule);
    }
    rules.sort_by(|a, b| a.at.total_cmp(&b.at));
    for (at, is_rule) in found.data().iter().enumerate() {
        if *is_rule {
            strokes.data_mut()[at] = false;
            erased.data_mut()[at] = true;
        }
    }
    rules
}

/// Returns the pixels that lie on a nearly unbroken line along y of at least this length.
fn long_runs(strokes: &Mask, length_mm: f64) -> Mask {
    let (width, height) = (strokes.width(), strokes.height());
    let length = (length_mm / PIXEL_MM) as usize;
    let needed = (RULE_COVER * length as f64) as u32;
    let mut found = Mask::new(width, height, false);
    if height < length {
        return found;
    }
    // Strokes within one pixel across count, so that a slight tilt does not break a rule.
    let wide = |y: usize, x: usize| {
        let row = strokes.row(y);
        row[x] || (x > 0 && row[x - 1]) || (x + 1 < width && row[x + 1])
    };
    let wide = Mask::from_fn(width, height, |x, y| wide(y, x));
    let mut counts = vec![0_u32; width];
    // The last row up to which the window that ends above or at it is covered.
    let mut covered = Mask::new(width, height, false);
    for y in 0..height {
        for (x, count) in counts.iter_mut().enumerate() {
            *count += u32::from(wide.at(x, y));
            if y >= length {
                *count -= u32::from(wide.at(x, y - length));
            }
            if y + 1 >= length && *count >= needed {
                covered.set(x, y, true);
            }
        }
    }
    let mut until = vec![0_usize; width];
    for y in (0..height).rev() {
        for (x, until) in until.iter_mut().enumerate() {
            if covered.at(x, y) {
                *until = length;
            }
            if *until > 0 {
                *until -= 1;
                found.set(x, y, strokes.at(x, y));
            }
        }
    }
    found
}

/// Groups the pixels of long lines by their positions across.
fn group(found: &Mask) -> Vec<Rule> {
    let (width, height) = (found.width(), found.height());
    let mut rules = Vec::new();
    let mut lengths = vec![0_usize; width];
    for y in 0..height {
        for (length, set) in lengths.iter_mut().zip(found.row(y)) {
            *length += usize::from(*set);
        }
    }
    let gap = (LINE_SPREAD_MM / 2.0 / PIXEL_MM) as usize;
    let mut x = 0;
    while x < width {
        if lengths[x] == 0 {
            x += 1;
            continue;
        }
        let (first, mut last, mut next) = (x, x, x);
        while next < width && next <= last + gap {
            if lengths[next] > 0 {
                last = next;
            }
            next += 1;
        }
        let sum: usize = lengths[first..=last].iter().sum();
        let rows = (0..height)
            .filter(|y| found.row(*y)[first..=last].iter().any(|set| *set))
            .count();
        if rows as f64 * PIXEL_MM >= LINE_MM {
            let weighted: usize = (first..=last).map(|x| x * lengths[x]).sum();
            rules.push(Rule {
                at: weighted as f64 / sum as f64,
                edges: [first as f64 - 0.5, last as f64 + 0.5],
                length: rows,
            });
        }
        x = next;
    }
    rules
}

/// Erases the thin strokes along a rule, also where it is broken into short parts.
pub(super) fn erase_thin(strokes: &mut Mask, erased: &mut Mask, rule: &Rule) {
    let width = strokes.width();
    let spread = LINE_SPREAD_MM / PIXEL_MM;
    let low = (rule.edges[0] - spread).max(0.0) as usize;
    let high = ((rule.edges[1] + spread) as usize).min(width - 1);
    let thin = (THIN_MM / PIXEL_MM) as usize + (rule.edges[1] - rule.edges[0]) as usize / 2;
    for y in 0..strokes.height() {
        let row = &mut strokes.data_mut()[y * width..][..width];
        let mut x = low;
        while x <= high {
            if !row[x] {
                x += 1;
                continue;
            }
            let begin = row[..x].iter().rposition(|set| !set).map_or(0, |k| k + 1);
            let end = x + row[x..].iter().position(|set| !set).unwrap_or(width - x);
            if end - begin <= thin && begin >= low && end <= high + 1 {
                row[begin..end].fill(false);
                erased.data_mut()[y * width + begin..y * width + end].fill(true);
            }
            x = end;
        }
    }
}

/// Returns the pixels of solid marks, such as the fish tails at the fold: parts that contain a square of `side` pixels,
/// or the solid pixels alone if they are the smaller part.
pub(super) fn find_solid(strokes: &Mask, side: usize) -> Mask {
    let solid = opened(strokes, side.max(1));
    let mut found = parts_covered(strokes, &solid, ORNAMENT_SHARE, 0);
    for (found, is_solid) in found.data_mut().iter_mut().zip(solid.data()) {
        *found |= is_solid;
    }
    found
}

/// Returns the parts of at least an area, in pixels, of which squares of `side` pixels cover more than a fraction.
pub(super) fn solid_parts(strokes: &Mask, side: usize, share: f64, least: usize) -> Mask {
    let solid = opened(strokes, side.max(1));
    parts_covered(strokes, &solid, share, least)
}

/// Returns the parts of at least an area, in pixels, of which a mask covers more than a fraction.
fn parts_covered(strokes: &Mask, cover: &Mask, share: f64, least: usize) -> Mask {
    if !cover.data().contains(&true) {
        return cover.clone();
    }
    let components = ConnectedComponents::label(strokes);
    let mut areas: Vec<[usize; 2]> = Vec::new();
    for y in 0..strokes.height() {
        for x in 0..strokes.width() {
            if let Some(label) = components.label_at(x, y) {
                if areas.len() <= label {
                    areas.resize(label + 1, [0; 2]);
                }
                areas[label][0] += 1;
                areas[label][1] += usize::from(cover.at(x, y));
            }
        }
    }
    Mask::from_fn(strokes.width(), strokes.height(), |x, y| {
        components.label_at(x, y).is_some_and(|label| {
            let [all, part] = areas[label];
            all >= least && part as f64 > share * all as f64
        })
    })
}

/// Returns the union of all squares of `side` pixels within a mask.
fn opened(mask: &Mask, side: usize) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    // Side of the largest square whose lower right pixel this is.
    let mut squares = Grid::new(width, height, 0_u16);
    for y in 0..height {
        for x in 0..width {
            if mask.at(x, y) {
                let before = if x > 0 && y > 0 {
                    let beside = squares.at(x - 1, y).min(squares.at(x, y - 1));
                    beside.min(squares.at(x - 1, y - 1))
                } else {
                    0
                };
                squares.set(x, y, before + 1);
            }
        }
    }
    let mut union = Mask::new(width, height, false);
    for y in 0..height {
        for x in 0..width {
            let square = usize::from(squares.at(x, y));
            if square >= side {
                for row in y + 1 - side..=y {
                    union.data_mut()[row * width + x + 1 - side..=row * width + x].fill(true);
                }
            }
        }
    }
    union
}

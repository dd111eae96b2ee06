//! Columns of text: the cheapest division of the page between valleys, rules and an even pitch.

use super::layout::{CELL_MM, Layout};

/// Pitches that are tried, mm, and the ratio of two neighbours.
const PITCHES_MM: [f64; 2] = [7.0, 28.0];
const PITCH_RATIO: f64 = 1.025;
/// Widths of columns that are tried, in pitches.
const WIDTHS: [f64; 2] = [0.65, 1.45];
/// Widths of the strip at the fold, in pitches.
const STRIP_WIDTHS: [f64; 2] = [0.4, 0.97];
/// Cost of a column whose width differs by a whole pitch from the pitch.
const WIDTH_COST: f64 = 6.0;
/// The narrowest column between two rules is the strip if it is narrower than this, in widths of the others.
const STRIP_WIDTH: f64 = 0.93;
/// Cost of a strip.
const STRIP_COST: f64 = 0.5;
/// The ink around a boundary counts at least as this fraction of that of the page.
const LEAST_AROUND: f64 = 0.3;
/// Largest cost of ink on a boundary, in relation to the ink around it.
const MAX_INK_COST: f64 = 1.5;
/// What a boundary gains if there is ink around it.
const BOUNDARY_GAIN: f64 = 0.45;
/// What a boundary on a rule gains, and a column over a rule costs.
const RULE_GAIN: f64 = 1.0;
const CROSSED_RULE_COST: f64 = 1.5;
/// Distance of a boundary from its rule, mm.
const RULE_REACH_MM: f64 = 0.7;
/// Fraction of the gain that is lost at this distance.
const RULE_SLOPE: f64 = 0.3;

/// A column of text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FoundColumn {
    /// First position across and the one after the last, cells of the layout.
    pub(super) across: [usize; 2],
    /// Whether it is the narrow strip at the fold.
    pub(super) is_strip: bool,
}

/// Columns and their pitch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    /// From left to right.
    pub(super) all: Vec<FoundColumn>,
    /// Distance of two columns, cells of the layout.
    pub(super) pitch: f64,
    /// Mean cost of a column.
    pub(super) cost: f64,
}

/// Finds the columns within the frame; `None` if there is no room for one.
pub(super) fn find_columns(layout: &Layout) -> Option<Columns> {
    let profile = layout.profile_across();
    let is_rule = rules_near(layout, profile.len());
    let nearness = |k: usize| match is_rule[k] {
        0 => 0.0,
        number => {
            let at = layout.inner_rules[number - 1] - layout.inside[0] as f64;
            1.0 - RULE_SLOPE * (k as f64 - at).abs() * CELL_MM / RULE_REACH_MM
        }
    };
    let count = (PITCHES_MM[1] / PITCHES_MM[0]).ln() / PITCH_RATIO.ln();
    (0..=count as i32)
        .map(|k| PITCHES_MM[0] / CELL_MM * PITCH_RATIO.powi(k))
        .filter_map(|pitch| {
            let boundaries = Boundaries::of(&profile, &is_rule, &nearness, pitch);
            divide(&profile, &boundaries, pitch)
        })
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .map(|mut found| {
            let left = layout.inside[0];
            for column in &mut found.all {
                column.across = column.across.map(|at| at + left);
            }
            found
        })
}

/// Returns for each position the number of the rule near it, from 1; 0 where there is none.
fn rules_near(layout: &Layout, count: usize) -> Vec<usize> {
    let mut near = vec![0; count + 1];
    let reach = RULE_REACH_MM / CELL_MM;
    for (number, rule) in layout.inner_rules.iter().enumerate() {
        let at = rule - layout.inside[0] as f64;
        for (k, near) in near.iter_mut().enumerate() {
            if (k as f64 - at).abs() <= reach {
                *near = number + 1;
            }
        }
    }
    near
}

/// Returns the means of the values within `reach` of each position.
fn means(values: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    (0..values.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// Marks the strip at the fold: a narrower column inside the page with rules at both sides.
fn mark_strip(columns: &mut [FoundColumn], is_ruled: &dyn Fn(usize) -> bool) {
    let width = |column: &FoundColumn| column.across[1] - column.across[0];
    let mut widths: Vec<usize> = columns.iter().map(width).collect();
    widths.sort_unstable();
    let usual = widths[widths.len() / 2] as f64;
    let last = columns.len().saturating_sub(1);
    let narrow = (columns.iter_mut().enumerate())
        .filter(|(k, column)| *k > 0 && *k < last && column.across.iter().all(|at| is_ruled(*at)))
        .min_by_key(|(_, column)| width(column));
    if let Some((_, column)) = narrow {
        column.is_strip |= (width(column) as f64) < STRIP_WIDTH * usual;
    }
}

/// Costs of the boundaries of columns.
struct Boundaries<'a> {
    /// Number of the rule near each position, from 1; 0 where there is none.
    rule_at: &'a [usize],
    /// Cost of a boundary at each position.
    cuts: Vec<f64>,
    /// Number of rules that begin at or before each position.
    rules_before: Vec<usize>,
}

impl<'a> Boundaries<'a> {
    fn of(
        profile: &[f64],
        rule_at: &'a [usize],
        nearness: &dyn Fn(usize) -> f64,
        pitch: f64,
    ) -> Self {
        let count = profile.len();
        let all = profile.iter().sum::<f64>() / count as f64;
        let around = means(profile, (pitch / 2.0) as usize);
        let cut = |k: usize| {
            if k == 0 || k == count {
                return 0.0;
            }
            let ink = f64::midpoint(profile[k - 1], profile[k]);
            let least = (LEAST_AROUND * all).max(1e-9);
            // Between empty columns, only a rule shows a boundary.
            let gain = BOUNDARY_GAIN * (around[k] / least).min(1.0);
            (ink / around[k].max(least)).min(MAX_INK_COST) - gain - RULE_GAIN * nearness(k)
        };
        let mut rules_before = vec![0_usize; count + 1];
        for k in 1..=count {
            let is_new = rule_at[k] > 0 && rule_at[k] != rule_at[k - 1];
            rules_before[k] = rules_before[k - 1] + usize::from(is_new);
        }
        Self {
            rule_at,
            cuts: (0..=count).map(cut).collect(),
            rules_before,
        }
    }

    /// Returns whether a position is an end of the page or on a rule.
    fn is_ruled(&self, k: usize) -> bool {
        k == 0 || k + 1 == self.cuts.len() || self.rule_at[k] > 0
    }

    /// Returns the cost of the rules inside a column. Those at its ends belong to the boundaries.
    fn crossed(&self, from: usize, to: usize) -> f64 {
        let last = self.rules_before[to] - usize::from(self.rule_at[to] > 0);
        CROSSED_RULE_COST * last.saturating_sub(self.rules_before[from]) as f64
    }

    /// Returns the cost of a column apart from its boundaries, and whether it is the strip; `None` for a wrong width.
    fn column(&self, from: usize, to: usize, pitch: f64) -> Option<(f64, bool)> {
        let width = (to - from) as f64 / pitch;
        let even = WIDTH_COST * (width - 1.0) * (width - 1.0);
        let is_strip = (STRIP_WIDTHS[0]..STRIP_WIDTHS[1]).contains(&width)
            && self.is_ruled(from)
            && self.is_ruled(to)
            && STRIP_COST < even;
        let cost = if is_strip { STRIP_COST } else { even };
        (is_strip || width >= WIDTHS[0]).then(|| (cost + self.crossed(from, to), is_strip))
    }
}

/// Divides a profile into columns of about one pitch.
fn divide(profile: &[f64], boundaries: &Boundaries, pitch: f64) -> Option<Columns> {
    let count = profile.len();
    let shortest = ((STRIP_WIDTHS[0] * pitch) as usize).max(1);
    let longest = (WIDTHS[1] * pitch) as usize;
    // Cost up to each boundary, the boundary before, and whether the strip lies between.
    let mut best = vec![(f64::INFINITY, 0_usize, false); count + 1];
    best[0] = (0.0, 0, false);
    for to in 1..=count {
        for from in to.saturating_sub(longest)..=to.saturating_sub(shortest) {
            let before = best[from].0;
            let Some((cost, is_strip)) = boundaries.column(from, to, pitch) else {
                continue;
            };
            let cost = before + cost + boundaries.cuts[to];
            if cost < best[to].0 {
                best[to] = (cost, from, is_strip);
            }
        }
    }
    if best[count].0.is_infinite() {
        return None;
    }
    let mut columns = Vec::new();
    let mut to = count;
    while to > 0 {
        let (_, from, is_strip) = best[to];
        columns.push(FoundColumn {
            across: [from, to],
            is_strip,
        });
        to = from;
    }
    columns.reverse();
    mark_strip(&mut columns, &|k| boundaries.is_ruled(k));
    Some(Columns {
        all: columns,
        pitch,
        cost: best[count].0,
    })
}

//! Time of each part by tier and method.

use mocban::demo::Tier;
use mocban::results::stats::median;

use super::markdown::{Table, number};
use super::method::Method;
use super::times::Part;
use super::trial::{Trial, of};

const NOTE: &str = "\
Mean milliseconds a pair on one core (time of the thread, so that other work on the machine does not count), over the \
pairs that went all the way; for stages with the share of the four. Vertices: median, each counted once.";

/// Makes a row for each tier and method.
pub(super) fn table(tiers: &[Tier], methods: &[Method], trials: &[Trial]) -> String {
    let mut heads = vec!["tier", "preset", "pairs", "vertices"];
    heads.extend(Part::ALL.map(Part::name));
    heads.extend(["four stages", "with reading"]);
    let mut table = Table::new("Time", &heads);
    for tier in tiers {
        for method in methods {
            let mut trials = of(trials, *tier, method);
            trials.retain(|trial| trial.outcome.is_ok());
            let mut cells = vec![tier.to_string(), method.name.to_owned()];
            cells.extend([trials.len().to_string(), vertices(&trials)]);
            cells.extend(times(&trials));
            table.push(cells);
        }
    }
    table.render(NOTE)
}

fn vertices(trials: &[&Trial]) -> String {
    let mut counts: Vec<f64> = trials.iter().map(|trial| trial.vertices as f64).collect();
    number(median(&mut counts), 0)
}

/// Returns the times of each part, of the four stages and of all parts.
fn times(trials: &[&Trial]) -> Vec<String> {
    let mean = |parts: &[Part]| {
        let sum: f64 = trials.iter().map(|trial| trial.times.sum_ms(parts)).sum();
        (!trials.is_empty()).then(|| sum / trials.len() as f64)
    };
    let stages = mean(&Part::STAGES);
    let cell = |part: Part| match (mean(&[part]), stages) {
        (Some(ms), Some(all)) if Part::STAGES.contains(&part) => {
            format!("{ms:.1} ({:.0} %)", 100.0 * ms / all)
        }
        (ms, _) => number(ms, 1),
    };
    let mut cells: Vec<String> = Part::ALL.map(cell).into();
    cells.extend([stages, mean(&Part::ALL)].map(|ms| number(ms, 1)));
    cells
}

//! Every number of every pair and metric as CSV, for calibration. A decoy has one line, for the chosen metric.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Context as _;

use super::decoys::Answer;
use super::numbers::Numbers;
use super::times::Part;
use super::trial::{Found, Trial};

/// Columns before the outcomes.
const HEADS: [&str; 14] = [
    "tier",
    "seed",
    "id",
    "decoy",
    "character",
    "preset",
    "metric",
    "failed",
    "pass",
    "angle_deg",
    "mirrored",
    "tre_pct",
    "tops_iou",
    "normal_deg",
];

/// Writes a line for each metric of each pair, and a single line for each pair that failed and for each decoy.
pub(super) fn write(path: &Path, trials: &[Trial], decoys: &[Answer]) -> anyhow::Result<()> {
    let paths = paths(trials, decoys);
    let text = || -> anyhow::Result<()> {
        let mut writer = csv::Writer::from_path(path)?;
        let parts = Part::ALL.map(|part| format!("ms.{}", part.name().replace(' ', "_")));
        let heads = HEADS.map(str::to_owned);
        writer.write_record(heads.iter().chain(&parts).chain(paths.iter().copied()))?;
        for trial in trials {
            for line in lines(trial, &paths) {
                writer.write_record(line)?;
            }
        }
        for decoy in decoys {
            writer.write_record(decoy_line(decoy, &paths))?;
        }
        Ok(writer.flush()?)
    };
    text().with_context(|| path.display().to_string())
}

/// Returns the paths that any result has, in order.
fn paths<'a>(trials: &'a [Trial], decoys: &'a [Answer]) -> BTreeSet<&'a String> {
    let found = trials
        .iter()
        .filter_map(|trial| trial.outcome.as_ref().ok());
    let of_trials = found.flatten().map(|found| &found.numbers);
    let of_decoys = decoys
        .iter()
        .filter_map(|decoy| decoy.outcome.as_ref().ok());
    of_trials
        .chain(of_decoys)
        .flat_map(Numbers::paths)
        .collect()
}

fn lines(trial: &Trial, paths: &BTreeSet<&String>) -> Vec<Vec<String>> {
    match &trial.outcome {
        Ok(found) => found
            .iter()
            .map(|found| line(trial, Ok(found), paths))
            .collect(),
        Err(why) => vec![line(trial, Err(why), paths)],
    }
}

fn line(trial: &Trial, found: Result<&Found, &String>, paths: &BTreeSet<&String>) -> Vec<String> {
    let optional = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    let mut cells = vec![
        trial.case.tier.to_string(),
        trial.case.seed.to_string(),
        trial.id.clone(),
        String::new(),
        trial.character.clone(),
        trial.method.to_owned(),
    ];
    cells.extend(truth(found));
    cells.push(optional(trial.normal_deg));
    cells.extend(Part::ALL.map(|part| trial.times.ms(part).to_string()));
    cells.extend(values(found.ok().map(|found| &found.numbers), paths));
    cells
}

fn decoy_line(decoy: &Answer, paths: &BTreeSet<&String>) -> Vec<String> {
    let error = decoy.outcome.as_ref().err().cloned().unwrap_or_default();
    let case = &decoy.case;
    let mut cells = vec![
        case.tier.to_string(),
        case.seed.to_string(),
        case.index.to_string(),
        decoy.kind.name().to_owned(),
        String::new(),
        decoy.method.to_owned(),
        String::new(),
        error,
        false.to_string(),
    ];
    cells.resize(HEADS.len() + Part::ALL.len(), String::new());
    cells.extend(values(decoy.outcome.as_ref().ok(), paths));
    cells
}

fn values(numbers: Option<&Numbers>, paths: &BTreeSet<&String>) -> Vec<String> {
    let text = |path: &&String| numbers?.text(path);
    let cell = |path| text(path).unwrap_or_default().to_owned();
    paths.iter().map(cell).collect()
}

/// Returns the cells from `metric` to `tops_iou`.
fn truth(found: Result<&Found, &String>) -> [String; 7] {
    match found {
        Ok(Found { metric, errors, .. }) => [
            metric.to_string(),
            String::new(),
            errors.pass().to_string(),
            errors.angle_deg.to_string(),
            errors.mirrored.to_string(),
            errors.tre_pct.to_string(),
            errors
                .mask_iou
                .map(|iou| iou.to_string())
                .unwrap_or_default(),
        ],
        Err(why) => {
            let mut cells = [const { String::new() }; 7];
            cells[1].clone_from(why);
            cells[2] = false.to_string();
            cells
        }
    }
}

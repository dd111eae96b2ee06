//! Fits the weights of the confidence model (`stages/register/confidence.rs`) and checks them on other seeds.
//!
//! Training examples are alignments of the chosen pairs and of their decoys (another character's print, a mirrored
//! mesh, an uncarved plate). `register.min_confidence` is 0, so that no alignment is refused for low confidence. The
//! pose weights predict whether rotation and landmarks are right. The mask weights predict whether the mask is right,
//! and are fitted only on examples with a right pose. Both are fitted by logistic regression with a ridge penalty on
//! standardized inputs, using Newton's method (iteratively reweighted least squares).

use std::fmt::Write as _;

use mocban::report::ground_truth::{
    MAX_ANGLE_DEG, MAX_TRE_PCT, MIN_MASK_IOU, TruthErrors, TruthRecord,
};
use mocban::report::tops_iou;
use mocban::stages::AlignedPair;
use mocban::stages::register::ConfidenceInputs;
use nalgebra::{DMatrix, DVector};

use super::case::Case;
use super::decoy::Decoy;
use super::decoys::input;
use super::markdown::{Table, number};
use super::method::Method;
use super::options::Options;
use super::run::Run;
use super::workers::in_order;

/// Weight of the ridge penalty on the weights of the standardized inputs.
const RIDGE: f64 = 1.0;
/// Newton steps; the fit has converged long before.
const MAX_STEPS: usize = 50;
/// Bins of the reliability table: upper ends of confidence.
const BINS: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0];

const NOTE: &str = "\
Pairs and decoys of the held-out seeds, one row for each range of confidence: number of results, mean confidence and \
share that is right (rotation, landmarks and mask), under the built-in weights and under the fitted ones.";

/// One metric's result of one pair.
#[derive(Debug, Clone, Copy)]
struct Example {
    inputs: ConfidenceInputs,
    is_pose_right: bool,
    is_mask_right: bool,
}

/// Weights of both logistic models.
struct Weights {
    pose: Vec<f64>,
    mask: Vec<f64>,
}

/// Fits the weights on the chosen pairs. Returns them as Rust code, with a reliability table for the held-out seeds.
pub(super) fn report(options: &Options, method: &Method) -> anyhow::Result<String> {
    let training = examples(&options.cases(), method, options)?;
    let held_out = examples(&options.held_out_cases(), method, options)?;
    let fitted = fit(&training);
    let mut text = format!(
        "## Confidence weights fitted on {} results\n\n```rust\n{}{}```\n\n",
        training.len(),
        constant("POSE", "POSE_INPUTS", &fitted.pose),
        constant("MASK", "MASK_INPUTS", &fitted.mask),
    );
    text.push_str(&reliability(&held_out, &fitted));
    Ok(text)
}

/// Aligns every pair and its decoys. Returns one example for each metric of each alignment.
fn examples(cases: &[Case], method: &Method, options: &Options) -> anyhow::Result<Vec<Example>> {
    let mut settings = method.settings.clone();
    settings.register.min_confidence = 0.0;
    let of_case = |index: usize| -> anyhow::Result<Vec<Example>> {
        let case = &cases[index];
        let (pair, given) = case.make()?;
        let truth = TruthRecord::read(&serde_json::to_value(&pair.truth)?)?;
        let mut found = Vec::new();
        if let Ok((_, aligned)) = &Run::new(&given, &settings).result {
            for (outcome, inputs) in results(aligned) {
                let map = aligned.print_from_mesh(outcome);
                let iou = tops_iou(&aligned.depth, outcome, &pair.tops);
                found.push(example(inputs, &truth.measure(&map, Some(iou))?));
            }
        }
        for kind in Decoy::ALL {
            if let Ok((_, aligned)) = &Run::new(&input(case, kind)?, &settings).result {
                found.extend(results(aligned).map(|(_, inputs)| Example {
                    inputs: *inputs,
                    is_pose_right: false,
                    is_mask_right: false,
                }));
            }
        }
        Ok(found)
    };
    let found = in_order(cases.len(), options.workers, of_case)?;
    Ok(found.into_iter().flatten().collect())
}

fn results(
    aligned: &AlignedPair,
) -> impl Iterator<Item = (&mocban::domain::MetricOutcome, &ConfidenceInputs)> {
    aligned
        .metrics()
        .iter()
        .zip(&aligned.registered.confidence_inputs)
}

fn example(inputs: &ConfidenceInputs, errors: &TruthErrors) -> Example {
    Example {
        inputs: *inputs,
        is_pose_right: errors.angle_deg <= MAX_ANGLE_DEG && errors.tre_pct <= MAX_TRE_PCT,
        is_mask_right: errors.mask_iou.is_none_or(|iou| iou >= MIN_MASK_IOU),
    }
}

/// Fits both models.
fn fit(examples: &[Example]) -> Weights {
    let rows =
        |examples: &[&Example], inputs: fn(&Example) -> Vec<f64>, label: fn(&Example) -> bool| {
            let x: Vec<Vec<f64>> = examples.iter().map(|e| inputs(e)).collect();
            let y: Vec<bool> = examples.iter().map(|e| label(e)).collect();
            logistic_regression(&x, &y)
        };
    let all: Vec<&Example> = examples.iter().collect();
    let with_right_pose: Vec<&Example> = examples.iter().filter(|e| e.is_pose_right).collect();
    Weights {
        pose: rows(&all, |e| e.inputs.pose.to_vec(), |e| e.is_pose_right),
        mask: rows(
            &with_right_pose,
            |e| e.inputs.mask.to_vec(),
            |e| e.is_mask_right,
        ),
    }
}

/// Fits a logistic regression with a ridge penalty. The first input of each row is the constant 1, which is not
/// penalized.
fn logistic_regression(inputs: &[Vec<f64>], labels: &[bool]) -> Vec<f64> {
    let (count, width) = (inputs.len(), inputs.first().map_or(0, Vec::len));
    let column = |k: usize| inputs.iter().map(move |row| row[k]);
    let scale: Vec<(f64, f64)> = (0..width)
        .map(|k| {
            let mean = column(k).sum::<f64>() / count as f64;
            let variance = column(k).map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
            if k == 0 {
                (0.0, 1.0)
            } else {
                (mean, variance.sqrt().max(1e-12))
            }
        })
        .collect();
    let x = DMatrix::from_fn(count, width, |i, k| {
        (inputs[i][k] - scale[k].0) / scale[k].1
    });
    let y = DVector::from_fn(count, |i, _| f64::from(u8::from(labels[i])));
    let penalty = DVector::from_fn(width, |k, _| if k == 0 { 1e-9 } else { RIDGE });
    let mut weights = DVector::zeros(width);
    for _ in 0..MAX_STEPS {
        let p = (&x * &weights).map(|sum: f64| 1.0 / (1.0 + (-sum).exp()));
        let gradient = x.transpose() * (&y - &p) - penalty.component_mul(&weights);
        let mut weighted = x.clone();
        for (mut row, p) in weighted.row_iter_mut().zip(p.iter()) {
            row *= (p * (1.0 - p)).max(1e-9);
        }
        let hessian = x.transpose() * weighted + DMatrix::from_diagonal(&penalty);
        let Some(step) = hessian.cholesky().map(|factor| factor.solve(&gradient)) else {
            break;
        };
        weights += &step;
        if step.amax() < 1e-9 {
            break;
        }
    }
    // Converts back to inputs that are not standardized.
    let mut plain: Vec<f64> = (0..width).map(|k| weights[k] / scale[k].1).collect();
    for k in 1..width {
        plain[0] -= plain[k] * scale[k].0;
    }
    plain
}

fn constant(name: &str, length: &str, weights: &[f64]) -> String {
    let numbers: Vec<String> = weights.iter().map(|w| format!("{w:.2}")).collect();
    format!(
        "const {name}: [f64; {length}] = [{}];\n",
        numbers.join(", ")
    )
}

impl Weights {
    fn confidence(&self, inputs: &ConfidenceInputs) -> f64 {
        let logistic = |weights: &[f64], inputs: &[f64]| {
            let sum: f64 = weights.iter().zip(inputs).map(|(w, x)| w * x).sum();
            1.0 / (1.0 + (-sum).exp())
        };
        logistic(&self.pose, &inputs.pose)
            * logistic(&self.mask, &inputs.mask)
            * inputs.of_character()
    }
}

/// Returns the reliability table and the mean log loss, for the built-in and for the fitted weights.
fn reliability(examples: &[Example], fitted: &Weights) -> String {
    let is_right = |e: &Example| e.is_pose_right && e.is_mask_right;
    let columns: [Vec<(f64, bool)>; 2] = [
        examples
            .iter()
            .map(|e| (e.inputs.confidence(), is_right(e)))
            .collect(),
        examples
            .iter()
            .map(|e| (fitted.confidence(&e.inputs), is_right(e)))
            .collect(),
    ];
    let heads = [
        "confidence up to",
        "built-in n",
        "mean",
        "right",
        "fitted n",
        "mean",
        "right",
    ];
    let mut table = Table::new("Reliability on held-out seeds", &heads);
    let mut from = 0.0;
    for to in BINS {
        let mut cells = vec![to.to_string()];
        for column in &columns {
            let inside = |c: f64| (c >= from || from == 0.0) && (c < to || to == 1.0);
            let bin: Vec<_> = column.iter().filter(|(c, _)| inside(*c)).collect();
            let mean = |value: &dyn Fn(&(f64, bool)) -> f64| {
                (!bin.is_empty())
                    .then(|| bin.iter().map(|e| value(e)).sum::<f64>() / bin.len() as f64)
            };
            cells.push(bin.len().to_string());
            cells.push(number(mean(&|e| e.0), 3));
            cells.push(number(mean(&|e| f64::from(u8::from(e.1))), 3));
        }
        table.push(cells);
        from = to;
    }
    let mut text = table.render(NOTE);
    for (name, column) in ["built-in", "fitted"].iter().zip(&columns) {
        let loss = |(c, right): &(f64, bool)| -(if *right { *c } else { 1.0 - c }).max(1e-9).ln();
        let mean = column.iter().map(loss).sum::<f64>() / column.len().max(1) as f64;
        let _ = writeln!(text, "\nMean log loss, {name}: {mean:.4}");
    }
    text
}

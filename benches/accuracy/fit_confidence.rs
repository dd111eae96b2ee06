//! Fits the weights of the confidence model (`stages/register/confidence.rs`) and checks them on other seeds.
//!
//! Training examples are alignments of the chosen pairs and of their decoys (the print of another character or of a
//! look-alike, a mirrored mesh, an uncarved plate). `register.min_confidence` is 0, so that no alignment is refused for
//! low confidence. The pose weights predict whether rotation and landmarks are right. The mask weights predict whether
//! the mask is right, and are fitted only on examples with a right pose. The character weights predict whether print
//! and relief show the same character, and are fitted on examples with a right pose and on wrong prints. The pose
//! weights leave out prints of similar characters. Wrong prints have less weight than pairs in the character model,
//! because they are rarer in practice. All are fitted by logistic regression with a ridge penalty on standardized
//! inputs, using Newton's method (iteratively reweighted least squares).

use mocban::results::ground_truth::{
    MAX_ANGLE_DEG, MAX_TRE_PCT, MIN_MASK_IOU, TruthErrors, TruthRecord,
};
use mocban::results::tops_iou;
use mocban::stages::AlignedPair;
use mocban::stages::register::ConfidenceInputs;
use nalgebra::{DMatrix, DVector};

use super::case::Case;
use super::decoy::Decoy;
use super::decoys::input;
use super::method::Method;
use super::options::Options;
use super::reliability::{Judged, table};
use super::run::Run;
use super::workers::in_order;

/// Weight of the ridge penalty on the weights of the standardized inputs.
const RIDGE: f64 = 1.0;
/// Newton steps; the fit has converged long before.
const MAX_STEPS: usize = 50;
/// Weight of a result of a wrong print in the fit of the character model. Results of matching pairs have the weight 1.
const WRONG_PRINT_WEIGHT: f64 = 0.2;
/// The fitted weights of the character model are multiplied by this factor. More wrong prints then have a confidence
/// below 0.5, and hardly more pairs, at a slightly higher calibration error.
const CHARACTER_FACTOR: f64 = 1.5;

const NOTE: &str = "\
Pairs and decoys of the held-out seeds, one row for each range of confidence: number of results, mean confidence and \
share that is right (rotation, landmarks and mask), under the built-in weights and under the fitted ones. A share is \
marked with ! if the mean lies outside its interval.";

/// One metric's result of one pair.
#[derive(Debug, Clone, Copy)]
struct Example {
    inputs: ConfidenceInputs,
    is_pose_right: bool,
    is_mask_right: bool,
    /// What was changed so that print and relief do not match. `None` for a pair as generated.
    decoy: Option<Decoy>,
}

/// A logistic model, one factor of the confidence.
struct Model {
    /// Name of the constant with the weights.
    constant: &'static str,
    /// Returns the inputs of the model.
    inputs: fn(&ConfidenceInputs) -> &[f64],
    /// Returns whether the model is fitted on an example.
    is_used: fn(&Example) -> bool,
    /// Returns what the model predicts.
    label: fn(&Example) -> bool,
    /// Weight of the results of decoys in the fit. Results of matching pairs have the weight 1.
    decoy_weight: f64,
    /// The fitted weights are multiplied by this factor.
    factor: f64,
}

/// All factors of the confidence.
const MODELS: [Model; 3] = [
    Model {
        constant: "POSE",
        inputs: |inputs| &inputs.pose,
        is_used: |example| example.decoy != Some(Decoy::LookAlike),
        label: |example| example.is_pose_right,
        decoy_weight: 1.0,
        factor: 1.0,
    },
    Model {
        constant: "MASK",
        inputs: |inputs| &inputs.mask,
        is_used: |example| example.is_pose_right,
        label: |example| example.is_mask_right,
        decoy_weight: 1.0,
        factor: 1.0,
    },
    Model {
        constant: "CHARACTER",
        inputs: |inputs| &inputs.character,
        is_used: |example| {
            example.is_pose_right
                || matches!(example.decoy, Some(Decoy::WrongPrint | Decoy::LookAlike))
        },
        label: |example| example.decoy.is_none(),
        decoy_weight: WRONG_PRINT_WEIGHT,
        factor: CHARACTER_FACTOR,
    },
];

/// Weights of all models.
struct Weights([Vec<f64>; MODELS.len()]);

/// Fits the weights on the chosen pairs. Returns them as Rust code, with a reliability table for the held-out seeds.
pub(super) fn report(options: &Options, method: &Method) -> anyhow::Result<String> {
    let training = examples(&options.cases(), method, options)?;
    let held_out = examples(&options.held_out_cases(), method, options)?;
    let fitted = fit(&training);
    let constants = MODELS.iter().zip(&fitted.0);
    let constants: String = constants
        .map(|(model, weights)| constant(model.constant, weights))
        .collect();
    let mut text = format!(
        "## Confidence weights fitted on {} results\n\n```rust\n{constants}```\n\n",
        training.len(),
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
                    decoy: Some(kind),
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
        decoy: None,
    }
}

/// Fits all models.
fn fit(examples: &[Example]) -> Weights {
    Weights(MODELS.map(|model| {
        let used: Vec<&Example> = examples.iter().filter(|e| (model.is_used)(e)).collect();
        let inputs: Vec<&[f64]> = used.iter().map(|e| (model.inputs)(&e.inputs)).collect();
        let labels: Vec<bool> = used.iter().map(|e| (model.label)(e)).collect();
        let share = |example: &&Example| match example.decoy {
            Some(_) => model.decoy_weight,
            None => 1.0,
        };
        let shares: Vec<f64> = used.iter().map(share).collect();
        let weights = logistic_regression(&inputs, &labels, &shares);
        weights.iter().map(|weight| weight * model.factor).collect()
    }))
}

/// Fits a logistic regression with a ridge penalty. The first input of each row is the constant 1, which is not
/// penalized. `shares` are the weights of the rows.
fn logistic_regression(inputs: &[&[f64]], labels: &[bool], shares: &[f64]) -> Vec<f64> {
    let (count, width) = (inputs.len(), inputs.first().map_or(0, |row| row.len()));
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
    let shares = DVector::from_column_slice(shares);
    let penalty = DVector::from_fn(width, |k, _| if k == 0 { 1e-9 } else { RIDGE });
    let mut weights = DVector::zeros(width);
    for _ in 0..MAX_STEPS {
        let p = (&x * &weights).map(|sum: f64| 1.0 / (1.0 + (-sum).exp()));
        let residuals = (&y - &p).component_mul(&shares);
        let gradient = x.transpose() * residuals - penalty.component_mul(&weights);
        let mut weighted = x.clone();
        for ((mut row, p), share) in weighted.row_iter_mut().zip(&p).zip(&shares) {
            row *= share * (p * (1.0 - p)).max(1e-9);
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

fn constant(name: &str, weights: &[f64]) -> String {
    let numbers: Vec<String> = weights.iter().map(|w| format!("{w:.2}")).collect();
    format!(
        "const {name}: [f64; {name}_INPUTS] = [{}];\n",
        numbers.join(", ")
    )
}

impl Weights {
    fn confidence(&self, inputs: &ConfidenceInputs) -> f64 {
        let factor = |(model, weights): (&Model, &Vec<f64>)| {
            let sum: f64 = weights
                .iter()
                .zip((model.inputs)(inputs))
                .map(|(w, x)| w * x)
                .sum();
            1.0 / (1.0 + (-sum).exp())
        };
        MODELS.iter().zip(&self.0).map(factor).product()
    }
}

/// Returns the reliability table for the built-in and for the fitted weights.
fn reliability(examples: &[Example], fitted: &Weights) -> String {
    let column = |confidence: &dyn Fn(&ConfidenceInputs) -> f64| -> Vec<Judged> {
        let judged = |e: &Example| (confidence(&e.inputs), e.is_pose_right && e.is_mask_right);
        examples.iter().map(judged).collect()
    };
    let columns = [
        ("built-in", column(&ConfidenceInputs::confidence)),
        ("fitted", column(&|inputs| fitted.confidence(inputs))),
    ];
    table("Reliability on held-out seeds", &columns, NOTE)
}

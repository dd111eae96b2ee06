//! `show BLOCK`: prints files, stages, characters and failures of a whole block.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::cli::output::context::Context;
use crate::cli::output::digits::{SCORE, fixed, significant};
use crate::cli::output::screen::{Palette, Tone};
use crate::cli::output::show_text::state_name;
use crate::cli::output::table::{columns, count};
use mocban_catalog::{BlockDetail, Catalog, StoredCharacter};
use mocban_core::domain::shell::quoted_id;
use mocban_core::domain::{BlockCharacterState, BlockStage, JobStatus, one_line, value_text};
use mocban_project::{ProjectResult, input_warnings};
use mocban_store::Project;
use mocban_system::time_text::{duration, local};

/// Number of characters that are listed of each kind.
const MAX_CHARACTERS: usize = 20;

/// Below this size of the characters, a page with a higher resolution is advised. The mean confidence of right results was
/// 0.71 at 16 px and 0.88 at 20 px (`--print-px` of the accuracy bench, tiers pose and hard, 51 pairs each).
const SMALL_PX: f64 = 16.0;

/// Significant digits of numbers that are not whole.
const DIGITS: i32 = 4;

/// Shows a block. `missing` names its files that are not at their places.
pub(crate) fn show_block(
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    missing: &[&str],
    project: &Project,
    context: &Context,
) -> ProjectResult<()> {
    let mut json = as_json(detail, characters, project)?;
    json["missing_files"] = json!(missing);
    context.print(&json, || text(detail, characters, missing, context.stdout))?;
    let quoted = quoted_id(detail.state.attributes.name.as_str());
    let failure = detail.state.failure.as_ref();
    match detail.state.status {
        // Control points may help.
        JobStatus::Quarantined if failure.is_some_and(|one| one.stage == BlockStage::Align) => {
            context.next(&format!("view {quoted}"));
        }
        JobStatus::Quarantined => context.next(&format!("retry {quoted}")),
        JobStatus::Leased => context.next("status --watch"),
        JobStatus::Ready | JobStatus::Backoff => context.next("run"),
        JobStatus::Done => {}
    }
    Ok(())
}

fn as_json(
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    project: &Project,
) -> ProjectResult<Value> {
    let mut value = serde_json::to_value(detail)?;
    value["schema"] = json!(1);
    value["warnings"] = json!(input_warnings::of_block(detail));
    value["character_list"] = serde_json::to_value(characters)?;
    value["artifacts_dir"] = json!(project.artifacts_dir().to_string_lossy());
    Ok(value)
}

fn text(
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    missing: &[&str],
    palette: Palette,
) -> String {
    let state = &detail.state;
    let attributes = &state.attributes;
    let tone = match state.status {
        JobStatus::Done => Tone::Good,
        JobStatus::Quarantined => Tone::Bad,
        JobStatus::Ready | JobStatus::Leased | JobStatus::Backoff => Tone::Warn,
    };
    let title = format!("block {}", attributes.name);
    let mut parts = vec![format!(
        "{}  {}\n",
        palette.paint(Tone::Strong, title),
        palette.paint(tone, state_name(state.status))
    )];
    let optional = |value: Option<String>, otherwise: &str| value.unwrap_or(otherwise.to_owned());
    let rows = [
        ("mesh", attributes.mesh_path.clone()),
        ("page", attributes.page_path.clone()),
        (
            "labels",
            optional(attributes.labels_path.clone(), "none: boxes are found"),
        ),
        (
            "unit",
            optional(
                attributes.unit.map(|unit| unit.to_string()),
                "found from the size",
            ),
        ),
        (
            "side",
            optional(attributes.side.map(|side| side.to_string()), "found"),
        ),
    ];
    let points = state.control_points.as_ref().map(|chosen| {
        let points = count(chosen.points.len() as u64, "point");
        ("control points", format!("{points} on the {}", chosen.side))
    });
    let rows = rows.into_iter().chain(points);
    let rows = rows.map(|(word, value)| {
        let note = if missing.contains(&word) {
            palette.paint(Tone::Bad, "  missing")
        } else {
            String::new()
        };
        vec![format!("  {word}"), value + &note]
    });
    let meta = attributes.meta.iter().flatten();
    let meta = meta.map(|(name, value)| vec![format!("  {name}"), value_text(value).into_owned()]);
    parts.push(columns(rows.chain(meta), "<<"));
    if let Some(failure) = &state.failure {
        let message = one_line(&failure.failure.message).into_owned();
        let word = palette.paint(Tone::Bad, "failed");
        let (stage, class) = (failure.stage, failure.failure.class);
        parts.push(format!("{word} at {stage}: {message} ({class})\n"));
    }
    parts.push(stages_text(detail, palette));
    parts.push(warnings_text(detail, palette));
    parts.push(characters_text(detail, characters, palette));
    parts.push(history_text(detail, palette));
    parts.concat()
}

/// Lists the stages with their times and the numbers of their outcomes.
fn stages_text(detail: &BlockDetail, palette: Palette) -> String {
    if detail.stages.is_empty() {
        return String::new();
    }
    let rows = detail.stages.iter().map(|stage| {
        vec![
            format!("  {}", stage.stage),
            duration(stage.ms),
            numbers(&stage.outcome),
        ]
    });
    let head = palette.paint(Tone::Strong, "stages");
    format!("{head}\n{}", columns(rows, "<><"))
}

fn warnings_text(detail: &BlockDetail, palette: Palette) -> String {
    let rows: Vec<_> = input_warnings::of_block(detail)
        .iter()
        .map(|text| vec![format!("  {}", one_line(text))])
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let head = palette.paint(Tone::Warn, "warnings");
    format!("{head}\n{}", columns(rows, "<"))
}

/// Ends of the names of numbers, and the units that they mean.
const UNITS: [(&str, &str); 4] = [
    ("px_per_mm", " px/mm"),
    ("_mm", " mm"),
    ("_px", " px"),
    ("_deg", "\u{b0}"),
];

/// Formats the numbers and short texts of an outcome on its first level: `agreement 0.93, side front, angle 0.1°`.
fn numbers(outcome: &Value) -> String {
    const MAX_TEXT: usize = 60;
    let entries = outcome.as_object().into_iter().flatten();
    let shown = entries.filter_map(|(name, value)| {
        let with_unit = |(end, unit): &(&str, &'static str)| Some((name.strip_suffix(end)?, *unit));
        let (short, unit) = UNITS.iter().find_map(with_unit).unwrap_or((name, ""));
        let [name, short] = [name, short].map(|name| name.replace('_', " "));
        match value {
            Value::Number(number) => {
                let number = match number.as_f64() {
                    Some(real) if !number.is_u64() && !number.is_i64() => significant(real, DIGITS),
                    _ => number.to_string(),
                };
                Some(format!("{short} {number}{unit}").trim_start().to_owned())
            }
            Value::Bool(flag) => Some(format!("{name} {flag}")),
            Value::String(text) if text.len() <= MAX_TEXT => {
                Some(format!("{name} {}", one_line(text)))
            }
            _ => None,
        }
    });
    shown.collect::<Vec<_>>().join(", ")
}

fn characters_text(
    detail: &BlockDetail,
    characters: &[StoredCharacter],
    palette: Palette,
) -> String {
    let state = &detail.state;
    if characters.is_empty() {
        return String::new();
    }
    let head = palette.paint(Tone::Strong, "characters");
    let mut text = format!("{head}  {} cut", state.characters);
    for (number, what) in [
        (state.low_confidence, "with low confidence"),
        (state.left_out, "left out"),
        (state.retired, "retired"),
    ] {
        if number > 0 {
            // Formatting into memory does not fail.
            let _ = write!(text, " · {number} {what}");
        }
    }
    text.push('\n');
    if let Some(line) = resolution(detail, characters) {
        let _ = writeln!(text, "  {line}");
    }
    let low = Catalog::LOW_CHARACTER_CONFIDENCE;
    let is_low = |one: &&StoredCharacter| {
        one.state == BlockCharacterState::Cut && one.confidence.is_some_and(|value| value < low)
    };
    let is_left = |one: &&StoredCharacter| one.state == BlockCharacterState::Left;
    let uncertain = characters.iter().filter(is_low).take(MAX_CHARACTERS);
    let left = characters.iter().filter(is_left).take(MAX_CHARACTERS);
    let rows = uncertain.chain(left).map(|one| {
        let confidence = one.confidence.map(|value| fixed(value, SCORE));
        vec![
            format!("  {}", one_line(&one.label)),
            confidence.unwrap_or_default(),
            one.reason.as_deref().map_or_else(
                || "low confidence".to_owned(),
                |reason| format!("left out: {}", one_line(reason)),
            ),
        ]
    });
    text + &columns(rows, "<><")
}

/// Says how large the characters are on the page: `2.6 px/mm: characters of about 25 px`. `None` before the page is
/// aligned, and if there are none.
fn resolution(detail: &BlockDetail, characters: &[StoredCharacter]) -> Option<String> {
    let align = detail
        .stages
        .iter()
        .find(|one| one.stage == BlockStage::Align)?;
    let px_per_mm = align.outcome.get("px_per_mm")?.as_f64()?;
    let longer = |[left, top, right, bottom]: [f64; 4]| (right - left).max(bottom - top);
    let mut sides: Vec<f64> = characters.iter().map(|one| longer(one.bounds)).collect();
    sides.sort_unstable_by(f64::total_cmp);
    let side = *sides.get(sides.len() / 2)?;
    let advice = if side < SMALL_PX {
        "; a page scanned at a higher resolution gives surer results"
    } else {
        ""
    };
    Some(format!(
        "{px_per_mm:.1} px/mm: characters of about {side:.0} px{advice}"
    ))
}

/// Lists failed attempts, the latest last.
fn history_text(detail: &BlockDetail, palette: Palette) -> String {
    const MAX_ATTEMPTS: usize = 5;
    let failed: Vec<_> = detail
        .attempts
        .iter()
        .filter_map(|attempt| Some((attempt, attempt.failure.as_ref()?)))
        .collect();
    if failed.is_empty() {
        return String::new();
    }
    let skipped = failed.len().saturating_sub(MAX_ATTEMPTS);
    let rows = failed[skipped..].iter().map(|(attempt, failure)| {
        vec![
            format!("  {}", local(attempt.at)),
            attempt.stage.to_string(),
            format!("{} ({})", one_line(&failure.message), failure.class),
        ]
    });
    let number = count(failed.len() as u64, "failed attempt");
    let head = palette.paint(Tone::Strong, number);
    format!("{head}\n{}", columns(rows, "<<<"))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::numbers;

    #[test]
    fn numbers_of_an_outcome_are_on_one_line() {
        let outcome = json!({
            "agreement": 0.93456, "windows": 120, "grid": [1, 2], "side": "front", "angle_deg": -0.1234,
            "px_per_mm": 10.234, "size_mm": 250,
        });
        assert_eq!(
            numbers(&outcome),
            "agreement 0.9346, angle -0.1234\u{b0}, 10.23 px/mm, side front, size 250 mm, windows 120"
        );
    }
}

//! Verdicts as `verdict log --json`, exports and backups write them, a JSON object a line.

use serde::Deserialize;

use super::verdict_file::{VerdictFileError, VerdictRow};
use crate::catalog::{Look, NewVerdict};
use crate::domain::{
    ContentHash, PairName, Reason, ReviewOrder, ThresholdMetric, UnixMillis, Verdict,
};
use crate::manifest::as_utf8;

/// A line; what else it has, such as numbers of the other log, means nothing here.
#[derive(Debug, Deserialize)]
struct VerdictLine {
    pair: PairName,
    verdict: Verdict,
    reviewer: String,
    metric: Option<ThresholdMetric>,
    result_hash: Option<ContentHash>,
    reason: Option<Reason>,
    note: Option<String>,
    event: Option<String>,
    seen: Option<ContentHash>,
    shown_ms: Option<u64>,
    angle_read_deg: Option<f64>,
    review_order: Option<ReviewOrder>,
    at: Option<UnixMillis>,
    undone_at: Option<UnixMillis>,
}

/// Reads all lines; those that were taken back are left out.
///
/// # Errors
/// At the first line that is wrong.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<VerdictRow>, VerdictFileError> {
    let text = as_utf8(bytes).map_err(|error| VerdictFileError::new(1, &error.to_string()))?;
    let lines = (1..).zip(text.split(|byte| *byte == b'\n'));
    let lines = lines.filter(|(_, content)| !content.trim_ascii().is_empty());
    let rows = lines.map(|(line, content)| {
        let parsed: VerdictLine = serde_json::from_slice(content)
            .map_err(|error| VerdictFileError::new(line, &words(&error)))?;
        if parsed.reviewer.trim().is_empty() {
            return Err(VerdictFileError::new(line, "reviewer is empty"));
        }
        Ok(parsed.undone_at.is_none().then(|| row(line, parsed)))
    });
    rows.filter_map(Result::transpose).collect()
}

fn row(line: u64, parsed: VerdictLine) -> VerdictRow {
    let verdict = NewVerdict {
        pair: parsed.pair,
        metric: parsed.metric,
        verdict: parsed.verdict,
        reviewer: parsed.reviewer,
        reason: parsed.reason,
        note: parsed.note,
        look: Look {
            event: parsed.event,
            seen: parsed.seen,
            shown_ms: parsed.shown_ms,
            angle_read_deg: parsed.angle_read_deg,
            review_order: parsed.review_order,
        },
        at: parsed.at,
    };
    VerdictRow {
        line,
        verdict,
        judged: parsed.result_hash,
    }
}

/// The parser's words, its own line number left out since each line is parsed alone.
fn words(error: &serde_json::Error) -> String {
    let words = error.to_string();
    words.split(" at line ").next().unwrap_or(&words).to_owned()
}

#[cfg(test)]
mod tests {
    use super::parse;
    use crate::domain::{Reason, ThresholdMetric, Verdict};

    #[test]
    fn a_line_is_read_back_and_what_was_taken_back_is_left_out() {
        let text = r#"{"id":1,"act":1,"pair":"0001","metric":"density","verdict":"fail","reviewer":"lan","reason":"angle","note":"a, b","at":5,"undone_at":null,"current":true}

{"pair":"0001","verdict":"pass","reviewer":"lan","undone_at":7}
{"pair":"0002","verdict":"pass","reviewer":"lan"}
"#;
        let rows = parse(text.as_bytes()).expect("valid");
        assert_eq!(rows.iter().map(|row| row.line).collect::<Vec<_>>(), [1, 4]);
        let first = &rows[0].verdict;
        assert_eq!(first.metric, Some(ThresholdMetric::Density));
        assert_eq!(first.verdict, Verdict::Fail);
        assert_eq!(first.reason, Some(Reason::Angle));
        assert_eq!(first.note.as_deref(), Some("a, b"));
        assert_eq!(rows[1].verdict.metric, None);
    }

    #[test]
    fn a_wrong_line_is_named_by_its_number() {
        let good = r#"{"pair":"1","verdict":"pass","reviewer":"lan"}"#;
        for (line, why) in [
            (
                r#"{"pair":"1","verdict":"maybe","reviewer":"lan"}"#,
                "maybe",
            ),
            (
                r#"{"pair":"1","verdict":"pass","reviewer":" "}"#,
                "reviewer is empty",
            ),
            (r#"{"pair":"1","verdict":"pass"}"#, "reviewer"),
            ("pass", "expected"),
        ] {
            let text = format!("{good}\n{line}\n");
            let error = parse(text.as_bytes()).expect_err("refused").to_string();
            assert!(
                error.starts_with("line 2: ") && error.contains(why),
                "{error}"
            );
        }
    }
}

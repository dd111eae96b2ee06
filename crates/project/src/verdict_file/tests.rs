//! Tests of the parsers of verdict files.

use std::collections::BTreeMap;
use std::path::Path;

use super::{RefusedLine, VerdictList, VerdictRow, check_values, unknown_pairs, unread_fields};
use mocban_core::domain::{PairName, Reason, ThresholdMetric, Verdict};

fn parse_csv(bytes: &[u8]) -> Result<Vec<VerdictRow>, RefusedLine> {
    VerdictList::new(bytes.to_vec(), false)?.rows().collect()
}

fn parse_jsonl(bytes: &[u8]) -> Result<Vec<VerdictRow>, RefusedLine> {
    VerdictList::new(bytes.to_vec(), true)?.rows().collect()
}

fn error(text: &str) -> String {
    parse_csv(text.as_bytes()).expect_err("refused").to_string()
}

#[test]
fn columns_may_be_in_any_order_and_optional_ones_missing() {
    let text = "reviewer,pair,verdict,metric,reason,note\n\
                lan,0001,pass,,,\n\
                lan,0002,fail,density,strokes_lost,\"thin, broken\"\n";
    let rows = parse_csv(text.as_bytes()).expect("valid");
    assert_eq!(rows[0].listed.verdict.verdict, Verdict::Pass);
    assert_eq!(rows[0].listed.verdict.metric, None);
    assert_eq!(rows[1].line, 3);
    assert_eq!(
        rows[1].listed.verdict.metric,
        Some(ThresholdMetric::Density)
    );
    assert_eq!(rows[1].listed.verdict.reason, Some(Reason::StrokesLost));
    assert_eq!(rows[1].listed.verdict.note.as_deref(), Some("thin, broken"));
    assert_eq!(parse_csv(b"pair,verdict,reviewer\n").expect("valid"), []);
}

#[test]
fn headers_and_words_may_be_capitals_or_vietnamese() {
    let plain = "pair,verdict,reviewer,metric,reason,note\n1,pass,lan,nl_ssim,,x\n2,fail,lan,density,strokes_lost,\n\
                 3,unsure,lan,,,\n";
    let plain = parse_csv(plain.as_bytes()).expect("valid");
    for text in [
        "Pair,Verdict,Reviewer,Metric,Reason,Note\n1,Pass,lan,NL_SSIM,,x\n2,FAIL,lan,Density,Strokes lost,\n3,Unsure,lan,,,\n",
        "Mã số,Đánh giá,Người đánh giá,Thước đo,Lý do,Ghi chú\n1,Đạt,lan,nl_ssim,,x\n2,không đạt,lan,density,Mất nét,\n\
         3,Chưa chắc,lan,,,\n",
        "MA SO,KET QUA,NGUOI CHAM,METRIC,LY DO,GHI CHU\n1,DAT,lan,nl ssim,,x\n2,Khong Dat,lan,density,mat net,\n\
         3,không chắc,lan,,,\n",
        "sep=;\n id ; \"verdict\" ;reviewer;metric;reason;note\n1;\u{a0}Pass;lan;nl_ssim;;x\n2;fail;lan;density;strokes_lost;\n\
         3;unsure;lan;;;\n",
    ] {
        let rows = parse_csv(text.as_bytes()).expect(text);
        let verdicts =
            |rows: &[VerdictRow]| -> Vec<_> { rows.iter().map(|row| row.listed.clone()).collect() };
        assert_eq!(verdicts(&rows), verdicts(&plain), "{text}");
    }
    assert_eq!(
        error("Pair,Verdict,Reviewer\n1,Maybe,lan\n"),
        "line 2: \"Maybe\" is not a verdict (pass, fail, unsure)"
    );
}

#[test]
fn fields_of_json_have_the_names_of_columns() {
    let plain = r#"{"pair":"1","verdict":"fail","reviewer":"lan","note":"x","act":1}"#;
    let plain = &parse_jsonl(plain.as_bytes()).expect("valid")[0].listed;
    for line in [
        r#"{"Pair":"1","VERDICT":"fail","reviewer ":"lan","Note":"x"}"#,
        r#"{"Mã số":1,"Đánh giá":"không đạt","người chấm":"lan","Ghi chú":"x"}"#,
        r#"{"id":"1","kết quả":"fail","reader":"lan","ghi_chu":"x"}"#,
        r#"{"id":"1","verdict":"fail","reviewer":"lan","note":"x"}"#,
        r#"{"id":7,"Mã cặp":"1","verdict":"fail","reviewer":"lan","note":"x"}"#,
    ] {
        let rows = parse_jsonl(line.as_bytes()).expect(line);
        assert_eq!(
            (&rows[0].listed, rows[0].unread.len()),
            (plain, 0),
            "{line}"
        );
    }
    // A table with an id beside the pair is refused, because the id may be either.
    let both = error("id,mã cặp,verdict,reviewer\n7,1,fail,lan\n");
    assert!(both.contains("column id is unknown"), "{both}");
    // Beside a pair, the id is that of the verdict.
    let log = r#"{"id":7,"pair":"1","verdict":"fail","reviewer":"lan","note":"x","who":""}"#;
    let rows = parse_jsonl(log.as_bytes()).expect("valid");
    assert_eq!((&rows[0].listed, &*rows[0].unread[0]), (plain, "who"));
    let twice = r#"{"pair":"1","verdict":"fail","reviewer":"lan","Pair":"2"}"#;
    let refused = parse_jsonl(twice.as_bytes())
        .expect_err("twice")
        .to_string();
    let reason =
        "line 1: the fields \"Pair\" and \"pair\" have the same name (upper and lower case, ";
    assert!(refused.starts_with(reason), "{refused}");
}

#[test]
fn a_list_may_have_the_angles_that_reviewers_read() {
    let rows = parse_csv(
        b"pair;verdict;reviewer;Angle read deg\n1;fail;lan;-4.5\n1;fail;lan;12,25\n1;pass;lan;\n",
    );
    let rows = rows.expect("valid");
    let angles = rows
        .iter()
        .map(|row| row.listed.verdict.context.angle_read_deg);
    let angles: Vec<Option<f64>> = angles.collect();
    assert_eq!(angles, [Some(-4.5), Some(12.25), None]);
    assert_eq!(
        error("pair,verdict,reviewer,Góc lệch\n1,fail,lan,left\n"),
        "line 2: angle_read_deg is \"left\", not a number of degrees such as -4.5"
    );
    for wrong in ["900", "NaN"] {
        let text = format!("pair,verdict,reviewer,angle_read_deg\n1,fail,lan,{wrong}\n");
        let row = &parse_csv(text.as_bytes()).expect("a number")[0];
        let refused = check_values(row, 1_795_219_200_000).expect_err(wrong);
        assert!(
            refused.to_string().contains("an angle is from"),
            "{refused}"
        );
    }
}

#[test]
fn json_of_python_has_no_values_for_missing_ones() {
    let rows =
        parse_jsonl(br#"{"pair":"1","verdict":"pass","reviewer":"lan","note":NaN,"metric":NaN}"#);
    assert_eq!(rows.expect("valid")[0].listed.verdict.note, None);
}

#[test]
fn times_are_parsed_and_other_texts_refused() {
    let rows =
        parse_csv(b"pair,verdict,reviewer,at\n1,pass,lan,2026-11-21 04:10:03\n1,pass,lan,\n");
    let rows = rows.expect("valid");
    assert_eq!(rows[0].listed.verdict.at, Some(1_795_234_203_000));
    assert_eq!(rows[1].listed.verdict.at, None);
    for (text, at) in [
        ("21/11/2026 04:10:03", 1_795_234_203_000),
        ("1.2.2026", 1_769_990_399_999),
    ] {
        let csv = format!("pair,verdict,reviewer,at\n1,pass,lan,{text}\n");
        let json = format!(r#"{{"pair":"1","verdict":"pass","reviewer":"lan","at":"{text}"}}"#);
        let csv = parse_csv(csv.as_bytes()).expect("valid").remove(0);
        let json = parse_jsonl(json.as_bytes()).expect("valid").remove(0);
        assert_eq!(csv.listed.verdict.at, Some(at), "{text}");
        assert!(csv.is_day_first && json.is_day_first);
        assert_eq!(json.listed, csv.listed, "{text}");
    }
    let refused = error("pair,verdict,reviewer,at\n1,pass,lan,yesterday\n");
    assert!(
        refused.starts_with("line 2: at is \"yesterday\""),
        "{refused}"
    );
}

#[test]
fn files_of_spreadsheets_are_read() {
    let plain = parse_csv(b"pair,verdict,reviewer,note\n1,pass,lan,\"a, b\"\n").expect("valid");
    let semicolons = "pair;verdict;reviewer;note\r\n1;pass;lan;a, b\r\n";
    let tabs = semicolons.replace(';', "\t");
    let utf16: Vec<u8> = "\u{feff}"
        .chars()
        .chain(tabs.chars())
        .flat_map(|c| (c as u16).to_le_bytes())
        .collect();
    for bytes in [semicolons.as_bytes(), tabs.as_bytes(), &utf16] {
        assert_eq!(parse_csv(bytes).expect("valid"), plain);
    }
    let cut = parse_csv(&utf16[..utf16.len() - 1]).expect_err("truncated");
    assert!(cut.to_string().contains("UTF-16"), "{cut}");
    let empty = "pair;verdict;reviewer;note\r\n;;;\r\n1;pass;lan;a, b\r\n; ;\u{a0};\r\n;;;;;;\r\n";
    let rows = parse_csv(empty.as_bytes()).expect("rows without cells are skipped");
    assert_eq!((rows.len(), rows[0].line), (1, 3));
    let latin = parse_csv(b"pair;verdict;reviewer\n1;pass;Nguy\xean\n").expect_err("not UTF-8");
    assert!(latin.to_string().contains("CSV UTF-8"), "{latin}");
}

#[test]
fn invalid_line_is_reported_by_number() {
    assert_eq!(
        error("pair,verdict,reviewer\n1,pass,lan\n2,maybe,lan\n"),
        "line 3: \"maybe\" is not a verdict (pass, fail, unsure)"
    );
    assert!(error("pair,verdict,reviewer\n1,pass,\n").starts_with("line 2: reviewer is empty"));
    let rude = error("pair,ver\u{1b}[2J\n");
    assert!(!rude.contains('\u{1b}'), "{rude}");
    assert!(error("pair,verdict\n").starts_with("line 1: column reviewer is missing"));
    assert_eq!(
        error("id,result,who\n"),
        "line 1: columns verdict, reviewer are missing; columns result, who are unknown; needed are pair, verdict and \
         reviewer, and possible metric, reason, note, at, angle_read_deg"
    );
    assert!(error("pair,verdict,reveiwer\n").contains("did you mean \"reviewer\"?"));
    let title = error("Ván 4\n\npair;verdict;reviewer\n1;pass;lan\n");
    assert_eq!(
        title,
        "line 1: this is no header; line 3 has the columns pair, verdict and reviewer: remove the lines above it"
    );
    assert!(error("pair,verdict,reviewer\n1,pass\n").starts_with("line 2: 2 cells"));
    assert!(error("pair,verdict,reviewer\na/b,pass,lan\n").starts_with("line 2: id"));
}

#[test]
fn values_that_no_verdict_has_are_refused_by_line() {
    const NOW: i64 = 1_800_000_000_000;
    let refused = |rows: Result<Vec<_>, RefusedLine>| {
        let rows: Vec<VerdictRow> = rows.expect("a list");
        rows.iter()
            .try_for_each(|row| check_values(row, NOW))
            .map_err(|error| error.to_string())
    };
    let good = "1,pass,lan,,,\n";
    for (row, why) in [
        (
            "1,pass,\"lan\nminh\",,,\n",
            "the reviewer's name must be one line",
        ),
        (
            "1,pass,lan\u{1b}[2J,,,\n",
            "the reviewer's name must be one line",
        ),
        ("1,pass,lan,angle,,\n", "only a fail has a reason"),
        ("1,pass,lan,,a\0b,\n", "a note is text of at most 2000"),
        (
            "1,pass,lan,,,2999-01-01\n",
            "the time of a verdict is from 1970",
        ),
        (
            "1,pass,lan,,,12/1/2999\n",
            "the time of a verdict is from 1970 to now, and this is 2999-01-12 in UTC; a date such as 3/4/2026 has the day first",
        ),
        (
            "1,pass,lan,,,1815-01-01\n",
            "the time of a verdict is from 1970",
        ),
    ] {
        let text = format!("pair,verdict,reviewer,reason,note,at\n{good}{row}");
        let error = refused(parse_csv(text.as_bytes())).expect_err(row);
        assert!(error.starts_with(&format!("line 3: {why}")), "{error}");
    }
    let good = r#""pair":"1","verdict":"pass","reviewer":" lan ""#;
    for (field, why) in [
        ("", ""),
        (r#","at":9223372036854775807"#, "the time of a verdict"),
        (r#","angle_read_deg":900"#, "an angle is from"),
        (r#","shown_ms":18446744073709551615"#, "the display time"),
        (r#","event":"a\u0000""#, "an event is 1 to 64"),
    ] {
        let text = format!("{{{good}{field}}}\n");
        let checked = refused(parse_jsonl(text.as_bytes()));
        let error = checked.err().unwrap_or_default();
        assert!(
            error.trim_start_matches("line 1: ").starts_with(why),
            "{error}"
        );
        assert_eq!(error.is_empty(), why.is_empty(), "{field}");
    }
    let twice = error("pair,verdict,reviewer,pair\n1,pass,lan,2\n");
    assert!(
        twice.starts_with("line 1: columns 1 and 4 are both named \"pair\""),
        "{twice}"
    );
}

#[test]
fn unknown_pair_is_reported_by_line() {
    let id = |text: &str| text.parse::<PairName>().expect("valid id");
    let lines = [("1", 2), ("2", 3), ("0", 4)].map(|(pair, line)| (id(pair), line));
    let unknown = ["0", "2"].map(id);
    let known = ["1", "0002", "7"].map(id);
    let refused = unknown_pairs(&lines.into(), &unknown, &known);
    let refused: Vec<String> = refused.iter().map(ToString::to_string).collect();
    assert_eq!(
        refused,
        [
            "line 3: there is no pair 2; did you mean \"0002\"?",
            "line 4: there is no pair 0; did you mean \"0002\"?"
        ]
    );
}

#[test]
fn all_refused_lines_are_listed_up_to_a_limit() {
    let file = Path::new("v.csv");
    let refused = |lines: std::ops::Range<usize>| {
        let lines = lines.rev().map(|line| RefusedLine::new(line, "wrong"));
        let refusal = RefusedLine::all_in_file(lines.collect(), file, "nothing was recorded");
        refusal.map(|refusal| refusal.to_string())
    };
    assert_eq!(refused(0..0), None);
    let one = refused(2..3);
    assert_eq!(
        one.as_deref(),
        Some("v.csv: line 2: wrong; nothing was recorded")
    );
    let two = refused(2..4);
    assert_eq!(
        two.as_deref(),
        Some("v.csv: 2 lines are refused; nothing was recorded:\n  line 2: wrong\n  line 3: wrong")
    );
    let many = refused(2..27).expect("refused");
    assert!(many.ends_with("line 21: wrong\n  and 5 more"), "{many}");
}

#[test]
fn a_quote_that_takes_in_further_verdicts_is_refused() {
    let text = "pair,verdict,reviewer,note\n1,pass,lan,ok\n2,fail,lan,\"thin\n3,fail,lan,ok\n";
    assert_eq!(
        error(text),
        "line 3: a quote is opened here and never closed"
    );
    let closed = format!("{text}4,pass,lan,\"ok\"\n");
    let closed = error(&closed);
    assert!(
        closed.starts_with("line 3: a quote is opened here, and the next one, on line 5,"),
        "{closed}"
    );
}

#[test]
fn json_lines_are_read_back_without_undone_verdicts() {
    let text = r#"{"id":1,"act":1,"pair":"0001","metric":"density","verdict":"fail","reviewer":"lan","reason":"angle","note":"a, b","at":5,"undone_at":null,"current":true}

{"pair":"0001","verdict":"pass","reviewer":"lan","undone_at":7}
{"pair":"0002","verdict":"pass","reviewer":"lan"}
"#;
    let rows = parse_jsonl(text.as_bytes()).expect("valid");
    assert_eq!(rows.iter().map(|row| row.line).collect::<Vec<_>>(), [1, 4]);
    let first = &rows[0].listed.verdict;
    assert_eq!(first.metric, Some(ThresholdMetric::Density));
    assert_eq!(first.verdict, Verdict::Fail);
    assert_eq!(first.reason, Some(Reason::Angle));
    assert_eq!(first.note.as_deref(), Some("a, b"));
    assert_eq!(rows[1].listed.verdict.metric, None);
}

#[test]
fn words_of_json_lines_may_be_capitals_or_vietnamese() {
    let plain =
        r#"{"pair":"1","verdict":"fail","reviewer":"lan","metric":"nl_ssim","reason":"angle"}"#;
    let words = r#"{"pair":1,"note":" ","verdict":"Không đạt","reviewer":"lan","metric":"NL-SSIM","reason":"Sai góc"}"#;
    let read = |line: &str| parse_jsonl(line.as_bytes()).expect("valid");
    assert_eq!(read(words), read(plain));
    for (old, new, why) in [
        (
            "nl_ssim",
            "IoU",
            "\"IoU\" is not a metric (nl_ssim, density, ensemble, relief)",
        ),
        ("\"metric\"", "\"pair\"", "the key \"pair\" is given twice"),
    ] {
        let refused = parse_jsonl(plain.replace(old, new).as_bytes());
        let text = refused.expect_err(new).to_string();
        assert_eq!(text, format!("line 1: {why}"));
    }
}

#[test]
fn fields_that_no_verdict_has_are_named() {
    let plain =
        r#"{"pair":"1","verdict":"pass","reviewer":"lan","angle_read_deg":2.5,"at":5,"act":1}"#;
    let other = r#"{"pair":"1","verdict":"pass","reviewer":"lan","angle":2.5,"who":null}"#;
    let rows = parse_jsonl(format!("{plain}\n{other}\n").as_bytes()).expect("valid");
    assert_eq!(rows[0].unread, [""; 0]);
    assert_eq!(rows[1].unread, ["angle", "who"]);
    assert_eq!(unread_fields(&BTreeMap::new()), None);
    let fields = [("angle".to_owned(), 2), ("who".to_owned(), 3)];
    assert_eq!(
        unread_fields(&fields.into()).as_deref(),
        Some(
            "fields that no verdict has are not read: angle (line 2), who (line 3); besides pair, verdict and reviewer, \
             metric, reason, note, at, angle_read_deg are"
        )
    );
}

#[test]
fn invalid_json_line_is_reported_by_number() {
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
        (
            r#"{"pair":"1","verdict":"pass","reviewer":null}"#,
            "reviewer is empty",
        ),
        (r#"{"pair":"1","verdict":"pass"}"#, "reviewer is missing"),
        (
            r#"{"pair":["1"],"verdict":"pass","reviewer":"lan"}"#,
            "pair is [\"1\"], not text",
        ),
        (
            r#"{"pair":"1","verdict":"pass","reviewer":"lan","angle_read_deg":"2,5"}"#,
            "\"2,5\" is not a number; write 2.5",
        ),
        (
            r#"{"pair":"1","verdict":"pass","reviewer":"lan","at":"yesterday"}"#,
            "at is \"yesterday\", not a time such as",
        ),
        (
            "[1]",
            "each row is a JSON object with pair, verdict and reviewer",
        ),
        ("pass", "not a JSON object, column 1: expected value"),
    ] {
        let text = format!("{good}\n{line}\n");
        let error = parse_jsonl(text.as_bytes())
            .expect_err("refused")
            .to_string();
        assert!(
            error.starts_with("line 2: ") && error.contains(why),
            "{error}"
        );
    }
}

#[test]
fn blanks_at_the_ends_of_an_id_are_left_out_and_a_line_break_within_is_named() {
    let csv = |id: &str| format!("pair,verdict,reviewer\n\"{id}\",pass,lan\n").into_bytes();
    let json = |id: &str| {
        let row = serde_json::json!({"pair": id, "verdict": "pass", "reviewer": "lan"});
        row.to_string().into_bytes()
    };
    for rows in [
        parse_csv(&csv("\n1\t")),
        parse_jsonl(&json("\n1\t\u{feff}")),
    ] {
        assert_eq!(rows.expect("valid")[0].listed.verdict.pair.as_str(), "1");
    }
    let why = "id \"1 a\" has a line break; write it on one line";
    for (refused, line) in [
        (parse_csv(&csv("1\na")), 2),
        (parse_jsonl(&json("1\na")), 1),
    ] {
        let text = refused.expect_err("two lines").to_string();
        assert_eq!(text, format!("line {line}: {why}"));
    }
}

//! Tests of times of verdicts that lie ahead of the clock.

use super::{VerdictList, check_values};

/// 2026-11-21T04:10:03Z.
const NOW: i64 = 1_795_234_203_000;

/// Returns why the time of a verdict in JSON is refused.
fn refused(at: &str) -> Option<String> {
    let row = format!(r#"{{"pair":"1","verdict":"pass","reviewer":"lan","at":{at}}}"#);
    let list = VerdictList::new(row.into_bytes(), true).expect("a list");
    let row = list.rows().next().expect("a row").expect("valid");
    let refused = check_values(&row, NOW).err();
    refused.map(|refused| refused.to_string())
}

#[test]
fn only_times_without_a_time_zone_may_be_hours_ahead() {
    for at in [
        "2026-11-21T04:14:00Z",
        "2026-11-21T11:14:00+07:00",
        "2026-11-21 18:10:00",
        "21/11/2026 18:10",
    ] {
        assert_eq!(refused(&format!("\"{at}\"")), None, "{at}");
    }
    assert_eq!(refused(&(NOW + 60_000).to_string()), None);
    for (at, ahead) in [
        ("\"2026-11-21T06:10:03Z\"".to_owned(), "2 h 00 min"),
        ("\"2026-11-21T11:20:03+07:00\"".to_owned(), "10 min 00 s"),
        ("\"2026-11-21 18:20:03\"".to_owned(), "14 h 10 min"),
        ((NOW + 360_000).to_string(), "6 min 00 s"),
    ] {
        let sentence = format!(
            "line 1: the time of a verdict is from 1970 to now, and this is {ahead} ahead of the clock of this computer; correct the time or the clock"
        );
        assert_eq!(refused(&at), Some(sentence), "{at}");
    }
    for far in [i64::MIN, i64::MAX] {
        let sentence = refused(&far.to_string()).expect("refused");
        assert!(sentence.contains("has the day first"), "{sentence}");
    }
}

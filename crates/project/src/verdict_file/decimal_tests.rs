//! Tests of pairs whose names are written with `.0`.

use std::collections::BTreeMap;

use super::{VerdictList, decimal_names, without_decimals};
use mocban_core::domain::PairName;

fn name(text: &str) -> PairName {
    PairName::new(text).expect(text)
}

#[test]
fn unknown_names_with_decimals_mean_whole_numbers() {
    let unknown = ["117.0", "118.00", "a.0", "0117.0"].map(name);
    let meant = without_decimals(&unknown);
    let expected = BTreeMap::from([(name("117.0"), name("117"))]);
    assert_eq!(meant, expected);
    let csv = "pair,verdict,reviewer\nb,pass,lan\n117.0,pass,lan\n";
    let json = r#"[{"pair":"b","verdict":"pass","reviewer":"lan"},
        {"pair":"117.0","verdict":"pass","reviewer":"lan"}]"#;
    for (text, is_json) in [(csv, false), (json, true)] {
        let list = VerdictList::new(text.as_bytes().to_vec(), is_json).expect(text);
        let pairs = |list: &VerdictList| {
            let rows = list.rows().map(|row| row.expect(text).listed.verdict.pair);
            rows.collect::<Vec<PairName>>()
        };
        assert_eq!(pairs(&list), ["b", "117.0"].map(name));
        assert_eq!(
            pairs(&list.with_meant(meant.clone())),
            ["b", "117"].map(name)
        );
    }
    let lines = BTreeMap::from([(name("117.0"), 3), (name("b"), 2)]);
    let warning = decimal_names(&meant, &lines).expect("a warning");
    let start =
        "whole numbers that are written with .0: 1, the first in column \"pair\" on line 3;";
    assert!(warning.starts_with(start), "{warning}");
    assert_eq!(decimal_names(&BTreeMap::new(), &lines), None);
}

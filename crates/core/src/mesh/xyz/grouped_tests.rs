//! Tests of points whose numbers have grouped digits.

use super::tests::{open, refused};
use crate::mesh::Vertices;

#[test]
fn apostrophes_group_digits_whatever_separates_numbers() {
    let grouped = "14'293,45;-1'024'808,22;742,5\n1'234;2'345,6;3'456\n";
    let wanted: Vertices = vec![[14_293.45, -1_024_808.22, 742.5], [1234.0, 2345.6, 3456.0]].into();
    for text in [
        grouped.to_owned(),
        grouped.replace('\'', "\u{2019}"),
        grouped.replace(';', "\t"),
        grouped.replace(';', " "),
        grouped.replace(',', "."),
        grouped.replace(',', ".").replace(';', ","),
        grouped.replace(';', "\";\"").replace('\n', "\"\n\""),
        format!("X;Y;Z\n{grouped}"),
    ] {
        let text = match text.strip_suffix('"') {
            Some(quoted) => format!("\"{quoted}"),
            None => text,
        };
        let read = open(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(read.vertices, wanted, "{text}");
    }
    // Two commas separate three coordinates; more may separate them or be decimal commas.
    let whole = open("14'293,24'808,742\n").expect("reads");
    assert_eq!(whole.vertices.at(0), [14_293.0, 24_808.0, 742.0]);
    for unclear in ["14'293,45,24'808,22,18'742,57\n", "14'293,24'808,742,255\n"] {
        assert_eq!(
            refused(&format!("1.5,2.5,3.5,4\n{unclear}")),
            "line 2: its commas may separate numbers or be part of them; write spaces between numbers"
        );
    }
}

#[test]
fn one_group_of_digits_is_a_fraction_unless_another_number_shows_groups() {
    let last = |text: &str| {
        let read = open(text).unwrap_or_else(|error| panic!("{error}: {text}"));
        read.vertices.at(read.vertices.len() - 1)
    };
    let [quoted, plain] = ["\"14,293\";\"24,808\";\"742,5\"\n", "14,293;24,808;742,5\n"];
    for text in [quoted, plain] {
        assert_eq!(last(text), [14.293, 24.808, 742.5], "{text}");
    }
    for text in [
        "\"14,293\",\"24,808.22\",\"-1,742\"\n",
        "\"1\",\"24,808.22\",\"2\"\n\"14,293\",\"24808.22\",\"-1,742\"\n",
        "\"14.293\",\"24.808,22\",\"-1.742\"\n",
    ] {
        assert_eq!(last(text), [14_293.0, 24_808.22, -1742.0], "{text}");
    }
    assert_eq!(
        refused("\"0,293\",\"24,808.22\",\"3\"\n"),
        "line 1: \"24,808.22\" has a point, but others have a comma; write all numbers with the same decimal mark"
    );
}

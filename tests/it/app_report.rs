//! Numbers on the page of the report: each leads to the list of the pairs that it counts.

use std::collections::BTreeSet;
use std::path::Path;

use crate::app::{html, open_app};
use crate::app_controls::varied_project;
use crate::cli::mocban;
use crate::page::Page;

/// Stores a verdict on the result of a pair by a metric.
fn judge(project: &Path, pair: &str, verdict: &str, reviewer: &str, metric: &str) {
    let set = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
    let set = [&set[..], &["--metric", metric]].concat();
    mocban(project, &set).expect(0);
}

/// Returns the numbers of a part of a page that lead to lists of pairs, each with the address of its list.
fn linked_numbers(shown: &str) -> Vec<(String, usize)> {
    let links = shown.split("href=\"pairs").skip(1);
    let numbers = links.filter_map(|link| {
        let (address, rest) = link.split_once('"')?;
        let (_, rest) = rest.split_once('>')?;
        let digits = rest.trim_start_matches("<b>").split('<').next()?;
        Some((address.replace("&amp;", "&"), digits.parse().ok()?))
    });
    numbers.collect()
}

/// Returns the ids of the pairs in a list.
fn listed(page: &Page, address: &str) -> BTreeSet<String> {
    let separator = if address.is_empty() { '?' } else { '&' };
    let list = html(page, &format!("/p/p/pairs{address}{separator}view=table"));
    let links = list.split("<a href=\"pair/").skip(1);
    let ids = links.filter_map(|link| link.split('/').next());
    ids.map(str::to_owned).collect()
}

#[test]
fn every_count_of_the_report_leads_to_its_pairs() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    varied_project(&dir);
    let project = dir.path().join("p");
    let list = "id,mesh,print\nlater,data/meshes/upright-0001.ply,data/prints/upright-0001.jpg\n";
    std::fs::write(project.join("later.csv"), list).expect("written");
    mocban(&project, &["import", "later.csv"]).expect(0);
    for (pair, verdict, reviewer, metric) in [
        ("upright-0000", "pass", "lan", "ensemble"),
        ("upright-0000", "fail", "minh", "ensemble"),
        ("upright-0001", "pass", "lan", "ensemble"),
        ("upright-0002", "unsure", "lan", "ensemble"),
        ("upright-0003", "fail", "lan", "ensemble"),
        ("upright-0003", "fail", "lan", "density"),
    ] {
        judge(&project, pair, verdict, reviewer, metric);
    }
    let page = open_app(dir.path());
    let shown = html(&page, "/p/p/report/numbers");
    // Means and shares have a decimal point; the counts are the other numbers of the table.
    let cells = shown.split("<td class=\"number\">").skip(1);
    for cell in cells.filter_map(|cell| cell.split("</td>").next()) {
        let is_bare_count = cell.parse::<u64>().is_ok_and(|count| count > 0);
        assert!(!is_bare_count, "{cell} leads to no list: {shown}");
    }
    let numbers = linked_numbers(&shown);
    for (address, count) in &numbers {
        let pairs = listed(&page, address);
        assert_eq!(pairs.len(), *count, "{address}: {pairs:?}");
    }
    let of = |wanted: &str| {
        let mut known = numbers.iter();
        known
            .find(|(address, _)| address == wanted)
            .map(|(_, count)| *count)
    };
    for (address, count) in [
        ("", 16),
        ("?state=aligned", 14),
        ("?state=failed&view=table", 1),
        ("?state=unfinished", 1),
        ("?state=retired", 1),
        ("?verdict=judged&metric=ensemble", 4),
        ("?verdict=judged&metric=density", 1),
        ("?verdict=joint-pass&metric=ensemble", 1),
        ("?verdict=joint-fail&metric=ensemble", 1),
        ("?verdict=decided&metric=ensemble", 2),
        ("?verdict=conflict&metric=ensemble", 1),
        ("?verdict=joint-unsure&metric=ensemble", 1),
    ] {
        assert_eq!(of(address), Some(count), "{address}: {numbers:?}");
    }
    assert!(of("?state=aligned&metric=relief").is_some(), "{numbers:?}");
}

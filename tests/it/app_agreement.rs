//! How far reviewers agree, on the page of reviews of `mocban app`, and what waits for a third person.

use serde_json::json;

use crate::app::{act, html, text, with_project};
use crate::cli::mocban;
use crate::page::{Page, answer};

/// Returns what waits for a third person: the sum, and that of each metric.
fn waiting(page: &Page) -> (u64, Vec<(String, u64)>) {
    let part = html(page, "/p/p/review/agreement?language=en");
    let number = |text: &str| text.parse::<u64>().expect("a number");
    let between = |text: &str, from: &str, to: &str| {
        let (_, rest) = text.split_once(from)?;
        rest.split_once(to).map(|(found, _)| found.to_owned())
    };
    let sum = between(&part, "<p class=\"notice\"><b>", "</b>");
    let list = between(&part, "<ul id=\"conflicts-by-metric\">", "</ul>");
    let list = list.unwrap_or_default();
    let of_metrics = list.split("order=adjudicate&amp;metric=").skip(1);
    let of_metrics = of_metrics.map(|metric| {
        let name = metric.split('"').next().expect("a name").to_owned();
        let waits = between(metric, "</a>: ", "</li>").expect("a number");
        (name, number(&waits))
    });
    (sum.map_or(0, |sum| number(&sum)), of_metrics.collect())
}

/// Settles all disagreements about the results of a metric, or of all.
fn settle(page: &Page, metric: &str) {
    let form = json!({"reviewer": "hoa", "metric": metric, "sample": "", "order": "adjudicate"});
    let reply = act(page, "/p/p/actions/review", &form, |_| {}).json();
    let review = format!("/p/p/{}api", reply["go"].as_str().expect("a page"));
    let queue = page.get(&format!("{review}/queue")).json();
    for (number, item) in queue["items"].as_array().expect("items").iter().enumerate() {
        let body = answer(&format!("settle-{metric}-{number}"), item, "pass");
        let reply = act(page, &format!("{review}/answer"), &body, |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
    }
}

#[test]
fn the_page_of_reviews_says_by_metric_what_waits_for_a_third_person() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    for (pair, second) in [
        ("upright-0000", "fail"),
        ("upright-0001", "fail"),
        ("upright-0002", "pass"),
    ] {
        for (reviewer, verdict) in [("lan", "pass"), ("minh", second)] {
            let set = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
            mocban(&project, &set).expect(0);
        }
    }
    let agreement = || mocban(&project, &["agreement", "--json"]).expect(0).json();
    let two = agreement()["reviewer_pairs"][0].clone();
    let row = format!(
        "<th scope=\"row\">lan, minh</th><td class=\"number\">{}</td><td class=\"number\">{}</td>",
        two["n"], two["agreed"]
    );
    let part = html(&page, "/p/p/review/agreement?language=en");
    assert!(part.contains(&row), "{row}: {part}");
    let two_of = |metrics: &[&str]| -> Vec<(String, u64)> {
        let two = metrics.iter().map(|metric| ((*metric).to_owned(), 2));
        two.collect()
    };
    let (all, of_metrics) = waiting(&page);
    assert_eq!(
        of_metrics,
        two_of(&["nl_ssim", "density", "ensemble", "relief"])
    );
    assert_eq!(agreement()["conflicts"], all);
    assert!(all <= 8, "metrics with the same image count once: {all}");
    // Images of the ensemble that another metric gave, too, still wait.
    settle(&page, "ensemble");
    let (rest, of_metrics) = waiting(&page);
    assert_eq!(of_metrics, two_of(&["nl_ssim", "density", "relief"]));
    assert_eq!(agreement()["conflicts"], rest);
    assert!((all - 2..=all).contains(&rest), "{all}, then {rest}");
    let vietnamese = html(&page, "/p/p/review/agreement?language=vi");
    assert!(
        vietnamese.contains("chỉ quyết định cho độ đo đã chọn"),
        "{vietnamese}"
    );
    settle(&page, "");
    assert_eq!(waiting(&page), (0, Vec::new()));
}

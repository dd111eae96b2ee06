//! Lists of pairs in the app: the least confident results of a run, and views that are saved.

use crate::app::{text, with_project};
use crate::page::Page;

fn html(page: &Page, path: &str) -> String {
    let reply = page.get(path);
    assert_eq!(reply.status, 200, "{path}: {}", text(&reply));
    text(&reply)
}

/// Returns the ids and confidences of the cards of a part of a page.
fn cards(part: &str) -> Vec<(String, String)> {
    let cards = part.split("class=\"pair-card\" href=\"").skip(1);
    let cards = cards.map(|card| {
        let id = card.split("pair/").nth(1).expect("an address");
        let id = id.split('/').next().expect("an id").to_owned();
        let confidence = card.split("confidence ").nth(1).expect("a confidence");
        let confidence = confidence.split('<').next().expect("a number").to_owned();
        (id, confidence)
    });
    cards.collect()
}

#[test]
fn the_page_of_the_run_has_the_least_confident_results_of_the_last_hour() {
    let (_dir, page) = with_project();
    let run = html(&page, "/p/p/");
    let worst = run.split("id=\"worst\"").nth(1).expect("a gallery");
    let worst = worst.split("</section>").next().expect("its end");
    assert!(
        worst.contains("Least confident of the last hour"),
        "{worst}"
    );
    let worst = cards(worst);
    assert_eq!(worst.len(), 6);
    let all = cards(&html(&page, "/p/p/pairs?sort=confidence"));
    assert_eq!(worst, all[..6]);
    html(&page, &format!("/p/p/pair/{}/", worst[0].0));
}

//! A pair aligned by the method of the paper, beside its stored result.

use crate::app::{html, text, with_project};
use crate::cli::mocban;

#[test]
fn a_pair_is_compared_with_the_method_of_the_paper_and_nothing_is_stored() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let stored = || mocban(&project, &["show", "upright-0000", "--json"]).expect(0);
    let before = stored().json();
    let pair = "/p/p/pair/upright-0000/";
    let plain = html(&page, pair);
    let link = "<a href=\"./?compare=paper\">The paper's method</a>";
    assert!(plain.contains(link), "{plain}");
    assert!(!plain.contains("paper-method"), "{plain}");
    let compared = html(&page, &format!("{pair}?compare=paper"));
    for part in [
        "data-load=\"paper-method?metric=ensemble\"",
        "aria-current=\"true\">The paper's method",
    ] {
        assert!(compared.contains(part), "{part}: {compared}");
    }
    let part = html(&page, &format!("{pair}paper-method?metric=ensemble"));
    for expected in [
        "src=\"picture/overlay-ensemble\"",
        "src=\"paper-method/overlay-ensemble\"",
        "The paper's method, Ensemble",
        "Rotation",
        "and not stored",
    ] {
        assert!(part.contains(expected), "{expected}: {part}");
    }
    let vietnamese = html(
        &page,
        &format!("{pair}paper-method?metric=relief&language=vi"),
    );
    for expected in [
        "Phương pháp của bài báo, Kết hợp",
        "Góc xoay",
        "một độ đo khác được hiện",
    ] {
        assert!(vietnamese.contains(expected), "{expected}: {vietnamese}");
    }
    for metric in ["ensemble", "density", "nl_ssim"] {
        let picture = page.get(&format!("{pair}paper-method/overlay-{metric}"));
        assert_eq!(picture.header("content-type"), Some("image/jpeg"));
        assert!(picture.body.len() > 1000, "{metric}");
    }
    for missing in ["overlay-x", "print-ensemble"] {
        let reply = page.get(&format!("{pair}paper-method/{missing}"));
        assert_eq!(reply.status, 404, "{missing}");
    }
    assert_eq!(stored().json(), before);
}

#[test]
fn a_pair_that_the_paper_s_method_aligned_is_not_compared_with_it() {
    let (dir, page) = with_project();
    let run = ["-C", "p", "--config", "paper", "run", "--progress", "none"];
    mocban(dir.path(), &[&run[..], &["upright-0001"]].concat()).expect(0);
    let pair = "/p/p/pair/upright-0001/";
    let shown = html(&page, &format!("{pair}?compare=paper"));
    assert!(!shown.contains("paper-method"), "{shown}");
    assert!(!shown.contains("The paper's method"), "{shown}");
    let refused = page.get(&format!("{pair}paper-method"));
    assert_eq!(refused.status, 422);
    let why = text(&refused);
    assert!(why.contains("no result of the default method"), "{why}");
}

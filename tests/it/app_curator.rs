//! What a curator relies on in the app: numbers and lists that agree, who settles a disagreement, failed blocks on every page, and
//! files that are replaced.

use std::path::Path;

use mocban::raster::{Grid, png_grey8};
use serde_json::{Value, json};

use crate::app::{act, html, open_app, text, with_project};
use crate::app_export_zip::{export, export_table};
use crate::app_uploads::{begun, encode, end, put};
use crate::block_correction::refused_block;
use crate::cli::mocban;
use crate::resume::RUN_SMALL;

/// Stores a verdict on the ensemble's result of a pair.
fn judge(project: &Path, pair: &str, verdict: &str, reviewer: &str, more: &[&str]) {
    let set = ["verdict", "set", pair, verdict, "--reviewer", reviewer];
    let set = [&set[..], &["--metric", "ensemble"], more].concat();
    mocban(project, &set).expect(0);
}

#[test]
fn the_list_behind_a_number_of_the_report_has_the_counted_pairs() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    judge(&project, "upright-0000", "pass", "lan", &[]);
    judge(&project, "upright-0000", "fail", "minh", &[]);
    judge(&project, "upright-0001", "pass", "lan", &[]);
    let report = html(&page, "/p/p/report/numbers");
    let link = "href=\"pairs?verdict=joint-pass&amp;metric=ensemble\">1<";
    assert!(report.contains(link), "{report}");
    let counted = html(&page, "/p/p/pairs?verdict=joint-pass&metric=ensemble");
    assert!(counted.contains("pair/upright-0001/"), "{counted}");
    assert!(!counted.contains("pair/upright-0000/"), "{counted}");
    let given = html(&page, "/p/p/pairs?verdict=pass&metric=ensemble");
    assert!(given.contains("pair/upright-0000/"), "{given}");
}

#[test]
fn an_open_review_is_shown_in_the_language_that_was_chosen_since() {
    let (_dir, page) = with_project();
    let form = json!({"reviewer": "lan", "metric": "density", "sample": "", "order": "random"});
    let reply = act(&page, "/p/p/actions/review", &form, |_| {}).json();
    let address = format!("/p/p/{}", reply["go"].as_str().expect("a page"));
    for language in ["vi", "en", "vi"] {
        html(&page, &format!("/p/p/review?language={language}"));
        let shown = html(&page, &address);
        assert!(
            shown.contains(&format!("<html lang=\"{language}\"")),
            "{shown}"
        );
    }
}

#[test]
fn the_page_of_the_run_leads_to_the_least_confident_results() {
    let (_dir, page) = with_project();
    let run = html(&page, "/p/p/");
    let link = "<a href=\"pairs?sort=confidence\">All results, least confident first</a>";
    assert!(run.contains(link), "{run}");
    html(&page, "/p/p/pairs?sort=confidence");
}

/// Returns the text of HTML.
fn without_tags(html: &str) -> String {
    let parts = html.split('<');
    let texts = parts.map(|part| part.split_once('>').map_or(part, |(_, text)| text));
    texts.collect()
}

#[test]
fn the_report_says_in_both_languages_what_is_not_counted() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    judge(&project, "upright-0000", "pass", "lan", &[]);
    judge(&project, "upright-0000", "fail", "minh", &[]);
    let shows = |language: &str, part: &str| {
        let shown = html(&page, &format!("/p/p/report/numbers?language={language}"));
        assert!(without_tags(&shown).contains(part), "{shown}");
    };
    shows(
        "en",
        "because reviewers disagree about every judged result.",
    );
    shows(
        "vi",
        "vì người đánh giá bất đồng về mọi kết quả đã đánh giá.",
    );
    judge(&project, "upright-0001", "pass", "lan", &[]);
    judge(&project, "upright-0002", "unsure", "lan", &[]);
    shows(
        "en",
        "Not counted: 1 on which reviewers disagree and 1 about which they were unsure.",
    );
    shows(
        "vi",
        "Không tính: 1 kết quả có bất đồng và 1 kết quả chưa chắc.",
    );
}

#[test]
fn the_report_is_saved_as_the_command_prints_it() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    judge(&project, "upright-0000", "pass", "lan", &[]);
    for (extension, format) in [
        ("csv", "csv"),
        ("tex", "latex"),
        ("md", "markdown"),
        ("json", "json"),
    ] {
        let saved = html(&page, &format!("/p/p/report/file/report.{extension}"));
        let printed = mocban(&project, &["report", "--format", format]);
        assert_eq!(saved, printed.expect(0).out, "{extension}");
    }
    let whole = html(&page, "/p/p/report/file/report.html?language=en");
    assert!(
        whole.starts_with("<!DOCTYPE html><html lang=\"en\">"),
        "{whole}"
    );
    let saved = html(&page, "/p/p/report/file/report.html?language=vi");
    let args = ["report", "--format", "html", "--lang", "vi"];
    let printed = mocban(&project, &args).expect(0).out;
    for vietnamese in [saved, printed] {
        for part in [
            "<html lang=\"vi\">",
            "Báo cáo về các chữ mộc bản đã căn chỉnh",
            "Acc của Kết hợp là ",
        ] {
            assert!(vietnamese.contains(part), "{part}: {vietnamese}");
        }
    }
    let refused = mocban(&project, &["report", "--lang", "vi"]).expect(2);
    let why = "--lang vi needs the format html, not text";
    assert!(refused.err.contains(why), "{}", refused.err);
}

#[test]
fn one_of_two_who_disagree_hears_that_a_third_person_must_settle_it() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    judge(&project, "upright-0000", "pass", "lan", &[]);
    judge(&project, "upright-0000", "fail", "minh", &[]);
    let start = |reviewer: &str, metric: &str| {
        let form =
            json!({"reviewer": reviewer, "metric": metric, "sample": "", "order": "adjudicate"});
        act(&page, "/p/p/actions/review", &form, |_| {})
    };
    let own = start("lan", "ensemble");
    assert_eq!(own.status, 422);
    let said = text(&own);
    assert!(
        said.contains("you have judged these results yourself (1)"),
        "{said}"
    );
    let other = text(&start("lan", "relief"));
    assert!(other.contains("no two reviewers disagree"), "{other}");
    assert_eq!(start("hoa", "ensemble").status, 200);
}

#[test]
fn a_review_for_another_person_begins_with_the_same_choices() {
    let (_dir, page) = with_project();
    let plain = html(&page, "/p/p/review");
    assert!(
        plain.contains("name=\"sample\" min=\"1\" value=\"50\""),
        "{plain}"
    );
    let all = html(&page, "/p/p/review?metric=relief&order=least_confident");
    for part in [
        "value=\"relief\" selected",
        "value=\"least_confident\" selected",
    ] {
        assert!(all.contains(part), "{part}: {all}");
    }
    assert!(!all.contains("value=\"50\""), "all results: {all}");
    let some = html(&page, "/p/p/review?sample=7&order=random");
    assert!(
        some.contains("name=\"sample\" min=\"1\" value=\"7\""),
        "{some}"
    );
    assert!(
        some.contains("<option value=\"\" selected>all metrics"),
        "{some}"
    );
}

#[test]
fn a_failed_block_is_named_on_every_page() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    refused_block(dir.path());
    let page = open_app(dir.path());
    for path in ["/", "/p/p/report/numbers", "/p/p/export"] {
        let shown = html(&page, path);
        assert!(shown.contains("1 block failed"), "{path}: {shown}");
        assert!(shown.contains("blocks?state=failed"), "{path}: {shown}");
    }
    let run = html(&page, "/p/p/");
    for part in [
        "<b>1</b><span>block failed<",
        "href=\"block/b1/\">b1<",
        "does not belong to this block",
    ] {
        assert!(run.contains(part), "{part}: {run}");
    }
    let review = json!({"reviewer": "lan", "metric": "", "sample": "", "order": "random"});
    let refused = act(&page, "/p/p/actions/review", &review, |_| {});
    assert!(
        text(&refused).contains("blocks failed (1)"),
        "{}",
        text(&refused)
    );
    export_table(&page);
    let exported = html(&page, "/p/p/export");
    assert!(
        exported.contains("a table for Excel: no pair has a result"),
        "{exported}"
    );
    let report = html(&page, "/p/p/report/numbers?language=vi");
    assert!(
        report.contains("Dự án chưa có cặp nào: 1 ván bị lỗi."),
        "{report}"
    );
}

#[test]
fn an_export_says_which_one_was_made() {
    let (_dir, page) = with_project();
    let body =
        json!({"purpose": "mesh", "only": "all", "metric": "ensemble", "pairs": ["upright-0000"]});
    export(&page, &body);
    let shown = html(&page, "/p/p/export");
    let title = "scans with their prints for MeshLab or CloudCompare (chosen pairs)";
    assert!(
        shown.contains(&format!("{title}: 1 pair was exported.")),
        "{shown}"
    );
}

#[test]
fn scans_or_unread_files_alone_get_a_next_step() {
    let (dir, page) = with_project();
    let send = |name: &str, file: &str, bytes: &[u8]| {
        let upload = begun(&page, name, 1);
        assert_eq!(put(&page, &upload, file, bytes).status, 200, "{file}");
        let reply = end(&page, &upload, "finish").json();
        let go = reply["go"].as_str().expect("an address").to_owned();
        html(&page, &format!("/{go}"))
    };
    let scene = send("scene", "x.glb", b"glTF");
    for part in ["a glTF scene is not read", "export them as PLY"] {
        assert!(scene.contains(part), "{part}: {scene}");
    }
    let document = send("document", "x.pdf", b"%PDF-1.7");
    assert!(document.contains("save their pages as PNG"), "{document}");
    let print = dir.path().join("p/data/prints/upright-0000.jpg");
    let print = std::fs::read(print).expect("a print");
    let prints = send("prints", "1.jpg", &print);
    assert!(
        prints.contains("Where are the scans of these prints?"),
        "{prints}"
    );
    let scans = send("scans", "1.stl", b"solid x");
    for part in [
        "Where are the prints of these scans?",
        "Use the prints of prints (1)",
    ] {
        assert!(scans.contains(part), "{part}: {scans}");
    }
}

#[test]
fn a_file_of_a_failed_pair_is_replaced_by_one_of_its_name() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let mesh = project.join("data/meshes/upright-0000.ply");
    let sound = std::fs::read(&mesh).expect("a mesh");
    std::fs::write(&mesh, "solid x").expect("written");
    mocban(&project, &RUN_SMALL).expect(3);
    let failed = html(&page, "/p/p/pair/upright-0000/");
    assert!(
        failed.contains("import?project=p&amp;mend=upright-0000"),
        "{failed}"
    );
    let hint = html(&page, "/import?project=p&mend=upright-0000");
    assert!(hint.contains("<code>upright-0000.ply</code>"), "{hint}");
    // A project that is gone has no pair to mend, and a new one no pages.
    let gone = page.get("/import?project=gone&mend=upright-0000");
    assert_eq!(gone.status, 404, "{}", text(&gone));
    let fresh = html(&page, "/import?project=gone");
    assert!(!fresh.contains("p/gone/pairs"), "{fresh}");
    let folder = dir.path().join("x");
    std::fs::create_dir(&folder).expect("a folder");
    std::fs::write(folder.join("upright-0000.ply"), sound).expect("written");
    let at = encode(folder.to_str().expect("UTF-8"));
    let offered = html(&page, &format!("/import?project=p&meshes={at}&prints={at}"));
    assert!(
        offered.contains("Replace its file by upright-0000.ply"),
        "{offered}"
    );
    let prints = encode(project.join("data/prints").to_str().expect("UTF-8"));
    let address = format!("/import?project=p&meshes={at}&prints={prints}&changed=yes");
    let joined = html(&page, &address);
    for part in ["<b>1</b> pair", "name=\"changed\" value=\"yes\" checked"] {
        assert!(joined.contains(part), "{part}: {joined}");
    }
}

#[test]
fn a_pair_without_a_result_shows_what_its_stages_have_made() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let blank = png_grey8(&Grid::new(120, 120, 255));
    std::fs::write(project.join("blank.png"), blank).expect("written");
    let list = "id,mesh,print\nblank,data/meshes/upright-0001.ply,blank.png\n";
    std::fs::write(project.join("more.csv"), list).expect("written");
    mocban(&project, &["import", "more.csv"]).expect(0);
    mocban(&project, &RUN_SMALL).expect(3);
    let shown = html(&page, "/p/p/pair/blank/");
    assert!(shown.contains("data-layer=\"relief\""), "{shown}");
    assert!(!shown.contains("data-layer=\"overlay\""), "{shown}");
    let relief = page.get("/p/p/pair/blank/picture/relief-ensemble");
    assert_eq!(relief.header("content-type"), Some("image/jpeg"));
    assert!(shown.contains("href=\"3d/\""), "{shown}");
    let scan = page.get("/p/p/pair/blank/3d/scan");
    assert_eq!(scan.status, 200, "{}", text(&scan));
    let (length, rest) = scan.body.split_at(4);
    let length = u32::from_le_bytes(length.try_into().expect("four bytes"));
    let header = serde_json::from_slice::<Value>(&rest[..length as usize]);
    let header = header.expect("a header");
    assert_eq!(header["is_alone"], true, "{header}");
    assert!(header["triangles"].as_u64() > Some(100), "{header}");
}

#[test]
fn the_history_of_a_pair_has_notes_in_order_of_time() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let note = ["--reason", "angle", "--note", "nghiêng"];
    judge(&project, "upright-0000", "fail", "lan", &note);
    let shown = html(&page, "/p/p/pair/upright-0000/");
    let history = shown.split("class=\"history\"").nth(1).expect("a history");
    let registered = history
        .find("registration with the print")
        .expect("a stage");
    let judged = history.find("<q>nghiêng</q>").expect("a note");
    assert!(registered < judged, "{history}");
}

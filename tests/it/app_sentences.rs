//! What the app says to people without a terminal: in both languages, and with buttons instead of commands.

use std::time::Instant;

use serde_json::json;

use crate::app::{act, app, open_app, text, with_project};
use crate::block_view::finished_block;
use crate::check::sql;
use crate::cli::mocban;
use crate::page::{Page, read_project};
use crate::resume::RUN_SMALL;
use crate::waiting::{LONGEST, pause, wait_until};
use mocban::store::Project;

/// Reads a page again until a text is on it.
fn wait_for(page: &Page, path: &str, part: &str) -> String {
    let deadline = Instant::now() + LONGEST;
    loop {
        let html = text(&page.get(path));
        if html.contains(part) {
            return html;
        }
        assert!(
            Instant::now() < deadline,
            "{part} is not on the page: {html}"
        );
        pause();
    }
}

#[test]
fn no_page_names_a_command_or_an_option() {
    let (_dir, page) = with_project();
    for path in [
        "/",
        "/p/p/",
        "/p/p/report/numbers",
        "/p/p/review",
        "/p/p/review/agreement",
        "/p/p/export",
        "/p/p/health",
        "/p/p/correct?what=side&pair=upright-0000",
        "/import",
        "/restore",
        "/p/nowhere/",
    ] {
        for language in ["en", "vi"] {
            let join = if path.contains('?') { '&' } else { '?' };
            let html = text(&page.get(&format!("{path}{join}language={language}")));
            for command in ["`", "mocban run", "mocban import", "mocban check", " --"] {
                assert!(
                    !html.contains(command),
                    "{path} {language} has {command}: {html}"
                );
            }
        }
    }
    let numbers = text(&page.get("/p/p/report/numbers?language=vi"));
    let all = "<a href=\"pairs?state=aligned\">15</a>";
    let aligned = format!("Cả {all} cặp đã được căn chỉnh");
    assert!(numbers.contains(&aligned), "{numbers}");
    assert!(
        numbers.contains("Chưa ai đánh giá kết quả nào"),
        "{numbers}"
    );
    let truth = "kết quả của Kết hợp là đúng";
    assert!(numbers.contains(truth), "{numbers}");
    assert!(!numbers.contains("lang=\"en\""), "{numbers}");
    let english = text(&page.get("/p/p/report/numbers?language=en"));
    let aligned = format!("All {all} pairs are aligned");
    assert!(english.contains(&aligned), "{english}");
}

#[test]
fn the_page_of_a_pair_doubts_a_unit_that_gives_no_character() {
    let (dir, page) = with_project();
    let pair = "/p/p/pair/upright-0000/";
    let said = "but most characters have 6 to 30 mm; is the unit mm?";
    let before = text(&page.get(pair));
    assert!(!before.contains("most characters have"), "{before}");
    let list = "id,mesh,print,unit\n\
                upright-0000,data/meshes/upright-0000.ply,data/prints/upright-0000.jpg,in\n";
    let project = dir.path().join("p");
    std::fs::write(project.join("list.csv"), list).expect("a list");
    mocban(&project, &["import", "list.csv"]).expect(0);
    let english = text(&page.get(&format!("{pair}?language=en")));
    assert!(english.contains(said), "{english}");
    assert!(!english.contains("mocban import"), "{english}");
    let vietnamese = text(&page.get(&format!("{pair}?language=vi")));
    let said = "trong khi đa số chữ có 6 đến 30 mm; đơn vị có phải là mm không?";
    assert!(vietnamese.contains(said), "{vietnamese}");
}

#[test]
fn a_refused_action_is_explained_in_the_language_of_the_page() {
    let (_dir, page) = with_project();
    for (language, expected) in [
        (
            "en",
            "700000 is not a number of pairs from 1 to 1\u{202f}024",
        ),
        ("vi", "700000 không phải là số cặp từ 1 đến 1\u{202f}024"),
    ] {
        page.get(&format!("/?language={language}"));
        let jobs = json!({"jobs": "700000", "which": "all"});
        let reply = act(&page, "/p/p/actions/run", &jobs, |_| {});
        assert_eq!(
            (reply.status, reply.json()["error"].as_str()),
            (422, Some(expected))
        );
    }
    let wrong = act(
        &page,
        "/p/p/actions/retire",
        &json!({"pair": "nobody"}),
        |_| {},
    );
    let error = wrong.json()["error"].to_string();
    assert!(error.contains("không có cặp hay ván nobody"), "{error}");
}

#[test]
fn an_address_without_a_page_is_explained_in_the_language_of_the_page() {
    let (_dir, page) = with_project();
    for (language, expected) in [
        ("en", "There is no such page."),
        ("vi", "Không có trang này."),
    ] {
        page.get(&format!("/?language={language}"));
        for path in ["/nowhere", "/p/p/nowhere/"] {
            let reply = page.get(path);
            let shown = text(&reply);
            assert_eq!(reply.status, 404, "{path}: {shown}");
            assert!(shown.contains(expected), "{path}: {shown}");
        }
    }
}

#[test]
fn a_project_a_pair_or_a_block_that_is_not_there_is_named() {
    let (dir, page) = with_project();
    let paths = ["/p/q/", "/p/p/pair/nothere/", "/p/p/block/nothere/"];
    for (language, said) in [
        (
            "en",
            [
                "The folder of the project q is not in",
                "This project has no pair nothere.",
                "This project has no block nothere.",
            ],
        ),
        (
            "vi",
            [
                "Thư mục của dự án q không có trong",
                "Dự án này không có cặp nothere.",
                "Dự án này không có ván nothere.",
            ],
        ),
    ] {
        for (path, part) in paths.into_iter().zip(said) {
            let reply = page.get(&format!("{path}?language={language}"));
            let shown = text(&reply);
            assert_eq!(reply.status, 404, "{path}: {shown}");
            assert!(shown.contains(part), "{path}: {shown}");
        }
    }
    // The project is moved away while its page is open.
    std::fs::rename(dir.path().join("p"), dir.path().join("moved")).expect("renamed");
    let run = json!({"jobs": "", "which": "all"});
    let reply = act(&page, "/p/p/actions/run", &run, |_| {});
    let error = reply.json()["error"].to_string();
    assert_eq!(reply.status, 404, "{error}");
    let part = "Thư mục của dự án p không có trong";
    assert!(error.contains(part), "{error}");
}

#[test]
fn damage_is_mended_by_a_button() {
    let (dir, page) = with_project();
    let project = Project::open(&dir.path().join("p")).expect("a project");
    sql(
        &project,
        "UPDATE metric_result SET result_hash = zeroblob(32) WHERE pair = 1 AND metric = 'relief'",
    );
    let done = "data-task=\"done\"";
    act(
        &page,
        "/p/p/actions/check",
        &json!({"what": "check"}),
        |_| {},
    );
    let found = wait_for(&page, "/p/p/health", done);
    assert!(found.contains("Damage was found. Press Repair"), "{found}");
    assert!(
        found.contains("pairs whose metrics differ from their result: 1"),
        "{found}"
    );
    let vietnamese = text(&page.get("/p/p/health?language=vi"));
    assert!(vietnamese.contains("Hãy bấm Sửa chữa"), "{vietnamese}");
    assert!(
        vietnamese.contains("cặp có số đo khác với kết quả: 1"),
        "{vietnamese}"
    );
    page.get("/?language=en");
    act(
        &page,
        "/p/p/actions/check",
        &json!({"what": "repair"}),
        |_| {},
    );
    let mended = wait_for(&page, "/p/p/health", "All damage was mended. Press Align");
    assert!(mended.contains(done), "{mended}");
    act(
        &page,
        "/p/p/actions/check",
        &json!({"what": "check"}),
        |_| {},
    );
    wait_for(&page, "/p/p/health", "files were checked. All are sound.");
}

#[test]
fn a_missing_input_is_said_although_all_results_are_sound() {
    let (dir, page) = with_project();
    let print = "p/data/prints/upright-0000.jpg";
    std::fs::remove_file(dir.path().join(print)).expect("removed");
    let check = json!({"what": "check"});
    act(&page, "/p/p/actions/check", &check, |_| {});
    let found = wait_for(&page, "/p/p/health", "1 missing input file:");
    assert!(found.contains("The results are sound, but"), "{found}");
    assert!(!found.contains("All are sound"), "{found}");
    let vietnamese = text(&page.get("/p/p/health?language=vi"));
    assert!(
        vietnamese.contains("upright-0000.jpg của upright-0000"),
        "{vietnamese}"
    );
    assert!(!vietnamese.contains("Tất cả đều tốt"), "{vietnamese}");
}

#[test]
fn lost_files_of_results_are_computed_again_after_a_button() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    std::fs::remove_dir_all(project.join("artifacts")).expect("removed");
    let start = |what: &str| {
        let reply = act(&page, "/p/p/actions/check", &json!({"what": what}), |_| {});
        assert_eq!(reply.status, 200, "{}", text(&reply));
    };
    start("repair");
    let found = wait_for(&page, "/p/p/health", "Most files of results are missing");
    assert!(found.contains("id=\"compute-lost\""), "{found}");
    let vietnamese = text(&page.get("/p/p/health?language=vi"));
    assert!(vietnamese.contains("bấm Chúng đã mất"), "{vietnamese}");
    page.get("/?language=en");
    start("lost");
    let mended = wait_for(&page, "/p/p/health", "All damage was mended. Press Align");
    assert!(!mended.contains("compute-lost"), "{mended}");
    mocban(&project, &RUN_SMALL).expect(0);
    mocban(&project, &["check"]).expect(0);
}

#[test]
fn another_method_is_said_to_replace_the_results() {
    let (_dir, page) = with_project();
    let asked = |value: &str, language: &str| {
        text(&page.get(&format!(
            "/p/p/settings?key=pipeline.method&value={value}&language={language}"
        )))
    };
    let sentence = "The results of the other method would be replaced. To keep both, import the pairs into a second project.";
    let english = asked("paper", "en");
    assert!(english.contains(sentence), "{english}");
    let vietnamese = asked("paper", "vi");
    assert!(
        vietnamese.contains("nhập các cặp vào một dự án thứ hai"),
        "{vietnamese}"
    );
    assert!(!asked("default", "en").contains(sentence));
    assert!(
        vietnamese.contains("<h2>Khớp mặt khắc</h2> <code>fit</code>"),
        "{vietnamese}"
    );
    let other = text(&page.get("/p/p/settings?key=register.min_confidence&value=0.4"));
    assert!(!other.contains(sentence), "{other}");
}

#[test]
fn blocks_are_counted_on_the_page_of_the_run() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_block(dir.path());
    let page = open_app(dir.path());
    let english = text(&page.get("/p/p/"));
    assert!(english.contains("1 of 1 block done"), "{english}");
    let vietnamese = text(&page.get("/p/p/?language=vi"));
    assert!(vietnamese.contains("xong 1 trên 1 ván"), "{vietnamese}");
}

#[cfg(unix)]
#[test]
fn a_run_that_fails_later_says_why_on_its_page() {
    use rustix::process::{Pid, Signal, kill_process};
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = read_project(&dir);
    let hold = dir.path().join("hold");
    let mut command = app(dir.path());
    command.args(["--lang", "en"]);
    command.env("MOCBAN_HOLD_AT", "register:computed:1");
    command.env("MOCBAN_HOLD_FILE", &hold);
    let page = Page::of(&mut command).entered();
    sql(
        &project,
        "DELETE FROM stage_result WHERE pair = 1; UPDATE job SET stage = 0, status = 0 WHERE pair = 1",
    );
    let reply = act(
        &page,
        "/p/p/actions/run",
        &json!({"jobs": "1", "which": "all"}),
        |_| {},
    );
    assert_eq!(reply.status, 200, "{}", text(&reply));
    wait_until("the run is held", || hold.exists());
    // The run has begun, so its start has succeeded.
    let running = wait_for(&page, "/p/p/", "id=\"stop\"");
    assert!(!running.contains("failed-run"), "{running}");
    let id = running.split(", process ").nth(1).expect("its process");
    let id: String = id.chars().take_while(char::is_ascii_digit).collect();
    let id = Pid::from_raw(id.parse().expect("a number")).expect("an id");
    kill_process(id, Signal::KILL).expect("killed");
    let failed = wait_for(&page, "/p/p/", "id=\"failed-run\"");
    assert!(
        failed.contains("before its work was done: it was killed (signal 9), perhaps because"),
        "{failed}"
    );
    assert!(failed.contains("Press Align to go on."), "{failed}");
    let vietnamese = text(&page.get("/p/p/?language=vi"));
    let killed = "tiến trình bị buộc dừng (tín hiệu 9), có thể vì hết bộ nhớ. Hãy bấm Căn chỉnh để chạy tiếp.";
    assert!(vietnamese.contains(killed), "{vietnamese}");
    // The list of projects leads there, also in an app that has not seen the end of the run.
    let list = "Lần chạy trước không kết thúc tốt. <a href=\"./p/p/\">";
    let home = text(&page.get("/"));
    assert!(home.contains(list), "{home}");
    drop(page);
    let next = open_app(dir.path());
    let seen = || ["/", "/p/p/"].map(|path| text(&next.get(path)));
    let [home, run] = seen();
    assert!(home.contains("The last run did not end well."), "{home}");
    let why = "it was killed, or the computer stopped. Press Align to go on.";
    assert!(run.contains(why), "{run}");
    mocban(project.dir(), &["run"]).expect(0);
    for html in seen() {
        assert!(!html.contains("failed-run"), "{html}");
    }
}

#[test]
fn an_export_says_why_it_leaves_out_pairs() {
    let (dir, page) = with_project();
    let set = [
        "verdict",
        "set",
        "upright-0001",
        "pass",
        "--reviewer",
        "lan",
    ];
    mocban(&dir.path().join("p"), &set).expect(0);
    let passed = json!({"purpose": "excel", "only": "passed", "metric": "relief"});
    act(&page, "/p/p/actions/export", &passed, |_| {});
    for (language, left_out) in [
        (
            "vi",
            "Số cặp bị bỏ qua theo lựa chọn của bạn: 14 chưa có đánh giá.",
        ),
        (
            "en",
            "Pairs that your choice leaves out: 14 without a verdict.",
        ),
    ] {
        wait_for(&page, &format!("/p/p/export?language={language}"), left_out);
    }
}

#[test]
fn a_deleted_scan_is_named_where_changed_files_are_looked_for() {
    let (dir, page) = with_project();
    // The files of a copied project are newer than its catalog knows.
    mocban(&dir.path().join("p"), &["run"]).expect(0);
    let scan = "data/meshes/upright-0000.ply";
    // Files are looked at anew for each press of the button, of which this is the time.
    let shown = |pressed: u64, language: &str| {
        let path = format!("/p/p/?looked={pressed}&language={language}");
        text(&page.get(&path))
    };
    let [before, after] = [9_999_999_999_998, 9_999_999_999_999];
    for (language, part) in [
        ("en", "No file has changed, and none is missing."),
        ("vi", "Không có tệp nào thay đổi hay bị thiếu."),
    ] {
        let html = shown(before, language);
        assert!(html.contains(part), "{part}: {html}");
    }
    std::fs::remove_file(dir.path().join("p").join(scan)).expect("removed");
    for (language, parts) in [
        ("en", ["Missing files", "No other file has changed."]),
        ("vi", ["Số tệp bị thiếu", "Không có tệp nào khác thay đổi."]),
    ] {
        let html = shown(after, language);
        let named = format!("{}: <b>1</b> ({scan}). ", parts[0]);
        for part in [named.as_str(), parts[1]] {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
}

#[test]
fn a_page_that_fails_is_tried_again_with_its_whole_address() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let page = open_app(dir.path());
    for language in ["en", "vi"] {
        let path = format!("/p/nowhere/pairs?state=failed&language={language}");
        let html = text(&page.get(&path));
        assert!(html.contains("href=\"pairs?state=failed\""), "{html}");
    }
}

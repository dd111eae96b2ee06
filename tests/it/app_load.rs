//! The memory of the app under many requests.

use std::path::Path;

use crate::app::{act, open_app, text};
use crate::app_export_zip::export_table;
use crate::app_killed_actions::write_block;
use crate::app_uploads::{begun, end, put};
use crate::block_view::finished_page;
use crate::cli::mocban;
use crate::page::{Page, answer, read_project};
use crate::review_load::peak_mib;
use crate::test_size::trials;

/// Pages, parts of pages, pictures and data, each for every client in every trial.
const PATHS: [&str; 36] = [
    "/",
    "/import",
    "/import?project=p",
    "/restore",
    "/p/p/",
    "/p/p/pairs",
    "/p/p/pairs?view=table&compare=density",
    "/p/p/pairs?state=aligned&sort=iou-down",
    "/p/p/pairs?state=retired",
    "/p/p/pairs?state=failed",
    "/p/p/pairs/view/low",
    "/p/p/pairs/listed?state=aligned",
    "/p/p/pair/upright-0000/",
    "/p/p/pair/upright-0000/?compare=paper",
    "/p/p/pair/upright-0000/paper-method",
    "/p/p/pair/upright-0001/picture/thumb-ensemble",
    "/p/p/pair/upright-0001/picture/relief-relief",
    "/p/p/pair/upright-0002/picture/overlay-density",
    "/p/p/pair/upright-0003/picture/print_mask-ensemble",
    "/p/p/pair/upright-0004/3d/",
    "/p/p/pair/upright-0004/3d/scan",
    "/p/p/blocks",
    "/p/p/review",
    "/p/p/review/agreement",
    "/p/p/report",
    "/p/p/report/numbers",
    "/p/p/report/file/report.csv",
    "/p/p/export",
    "/p/p/settings?key=run.workers&value=3",
    "/p/p/health",
    "/p/p/health/inputs",
    "/p/p/last-import",
    "/p/p/backup.sqlite",
    "/p/p/exports/excel.zip",
    "/p/p/review/lan/metric%3Drelief%26order%3Drandom/",
    "/p/p/review/lan/metric%3Drelief%26order%3Drandom/api/queue",
];
/// Pages and pictures of a block. Each opening decodes a large page and draws it.
const BLOCK_PATHS: [&str; 13] = [
    "/p/p/block/b1/",
    "/p/p/block/b1/view/",
    "/p/p/block/b1/view/block.json",
    "/p/p/block/b1/view/layer/page",
    "/p/p/block/b1/view/region/page/0/0/64/64",
    "/p/p/block/b1/view/scan/0",
    "/p/p/block/b1/view/correct",
    "/p/p/block/b1/view/correct/block.json",
    "/p/p/block/b1/view/correct/page",
    "/p/p/block/b1/view/boxes",
    "/p/p/block/b1/view/boxes/block.json",
    "/p/p/block/b1/view/boxes/page",
    "/p/p/blocks?state=failed",
];
/// The review whose items are answered.
const REVIEW: &str = "/p/p/review/lan/metric%3Drelief%26order%3Drandom/api";
/// Clients at the same time.
const CLIENTS: usize = 8;
/// Most memory by which the peak may grow after every path was read twice by all clients, MiB, whatever the number of trials.
/// It was 7 MiB for 15,000 requests: later on, more large replies may be made at the same time than before.
const GROWTH_MIB: u64 = 16;
/// The same after the pages of a block were read three times. Memory that stays when a block is opened again adds 19 MiB to it
/// in each trial. On a busy machine, one opening may still be read while the next one begins, which adds 65 MiB once.
const BLOCK_GROWTH_MIB: u64 = 90;

/// Returns all paths. Those of imports and backups name files.
fn paths(dir: &Path) -> Vec<String> {
    let project = dir.canonicalize().expect("a path").join("p");
    let project = project.to_str().expect("UTF-8");
    let folders = format!("project=new&meshes={project}/data/meshes&prints={project}/data/prints");
    let list = format!("project=new&list={project}/data/manifest.csv");
    let block =
        format!("project=new&meshes={project}/one/scan&prints={project}/one/page&whole_block=yes");
    let of_files = [
        format!("/import?{folders}"),
        format!("/import?{list}"),
        format!("/import/files?{folders}"),
        format!("/import/problems?{list}"),
        format!("/restore/content?backup={project}/backups/backup.sqlite"),
        format!("/import?{block}"),
        format!("/import/picture/page?{block}&place=0"),
        format!("/import/picture/scan?{block}&place=0"),
    ];
    let all = PATHS.into_iter().map(str::to_owned);
    all.chain(of_files).collect()
}

/// Opens the app on a folder with the project `p`, its backup and an export of it.
fn project_with_exports() -> (tempfile::TempDir, Page) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    read_project(&dir);
    let project = dir.path().join("p");
    write_block(&project);
    let views = r#"{"views":[{"name":"low","list":"confidence=low"}]}"#;
    std::fs::write(project.join("saved-views.json"), views).expect("written");
    mocban(&project, &["backup", "backups/backup.sqlite"]).expect(0);
    let page = open_app(dir.path());
    export_table(&page);
    (dir, page)
}

/// Reads a page.
fn read(page: &Page, path: &str) {
    let status = page.get(path).status;
    // The address of a saved view leads to its list.
    let is_view = path.contains("/pairs/view/");
    assert_eq!(status, if is_view { 303 } else { 200 }, "{path}");
}

/// Answers the same item again, which is stored once.
fn answer_again(page: &Page, client: usize) {
    let queue = page.get(&format!("{REVIEW}/queue")).json();
    let body = answer(&format!("load-{client}"), &queue["items"][client], "pass");
    let reply = act(page, &format!("{REVIEW}/answer"), &body, |_| {});
    assert_eq!(reply.status, 200, "{}", text(&reply));
}

/// Sends a file, and removes it.
fn send_file(page: &Page) {
    let upload = begun(page, "load", 1);
    let sent = put(page, &upload, "1.stl", &vec![b'x'; 1 << 16]);
    assert_eq!(sent.status, 200, "{}", text(&sent));
    assert_eq!(end(page, &upload, "cancel").status, 200);
}

#[test]
fn the_memory_of_the_app_does_not_grow_with_the_number_of_requests() {
    let (dir, page) = project_with_exports();
    let (page, paths) = (&page, paths(dir.path()));
    let paths = paths.as_slice();
    let round = |trials: usize| {
        std::thread::scope(|scope| {
            for client in 0..CLIENTS {
                scope.spawn(move || {
                    for index in 0..trials * paths.len() {
                        // Each client is at another place of the list.
                        read(page, &paths[(index + 3 * client) % paths.len()]);
                        if index % paths.len() == 0 {
                            answer_again(page, client);
                        }
                    }
                });
            }
        });
        for _ in 0..trials {
            send_file(page);
        }
        peak_mib(page.pid())
    };
    let first = round(2);
    let last = round(trials(3));
    assert!(last <= first + GROWTH_MIB, "{first} MiB, then {last} MiB");
}

#[test]
fn the_memory_of_the_app_does_not_grow_when_a_block_is_opened_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    finished_page(dir.path());
    let page = open_app(dir.path());
    let round = |trials: usize| {
        for _ in 0..trials {
            for path in BLOCK_PATHS {
                read(&page, path);
            }
        }
        peak_mib(page.pid())
    };
    let first = round(3);
    let last = round(trials(6));
    assert!(
        last <= first + BLOCK_GROWTH_MIB,
        "{first} MiB, then {last} MiB"
    );
}

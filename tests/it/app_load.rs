//! The memory of the app under many requests.

use std::path::Path;

use crate::app::with_project;
use crate::cli::mocban;
use crate::review_load::peak_mib;
use crate::test_size::trials;

/// Pages, parts of pages, pictures and data, each for every client in every trial.
const PATHS: [&str; 32] = [
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
];
/// Clients at the same time.
const CLIENTS: usize = 8;
/// Most memory by which the peak may grow after every path was read twice by all clients, MiB. Each of 29,600 requests, as
/// `MOCBAN_TRIALS=100` sends them, may keep 2 kB.
const GROWTH_MIB: u64 = 64;

/// Returns all paths. Those of imports and backups name files.
fn paths(dir: &Path) -> Vec<String> {
    let project = dir.canonicalize().expect("a path").join("p");
    let project = project.to_str().expect("UTF-8");
    let folders = format!("project=new&meshes={project}/data/meshes&prints={project}/data/prints");
    let list = format!("project=new&list={project}/data/manifest.csv");
    let of_files = [
        format!("/import?{folders}"),
        format!("/import?{list}"),
        format!("/import/files?{folders}"),
        format!("/import/problems?{list}"),
        format!("/restore/content?backup={project}/backups/backup.sqlite"),
    ];
    let all = PATHS.into_iter().map(str::to_owned);
    all.chain(of_files).collect()
}

#[test]
fn the_memory_of_the_app_does_not_grow_with_the_number_of_requests() {
    let (dir, page) = with_project();
    let project = dir.path().join("p");
    let views = r#"{"views":[{"name":"low","list":"confidence=low"}]}"#;
    std::fs::write(project.join("saved-views.json"), views).expect("written");
    mocban(&project, &["backup", "backups/backup.sqlite"]).expect(0);
    let (site, paths) = (&*page, paths(dir.path()));
    let paths = paths.as_slice();
    let round = |trials: usize| {
        std::thread::scope(|scope| {
            for client in 0..CLIENTS {
                scope.spawn(move || {
                    for index in 0..trials * paths.len() {
                        // Each client is at another place of the list.
                        let path = &paths[(index + 3 * client) % paths.len()];
                        let status = site.get(path).status;
                        // The address of a saved view leads to its list.
                        let is_view = path.contains("/pairs/view/");
                        assert_eq!(status, if is_view { 303 } else { 200 }, "{path}");
                    }
                });
            }
        });
        peak_mib(page.pid())
    };
    let first = round(2);
    let last = round(trials(3));
    assert!(last < first + GROWTH_MIB, "{first} MiB, then {last} MiB");
}

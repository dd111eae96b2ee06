//! The memory of the app under many requests.

use crate::app::with_project;
use crate::review_load::peak_mib;
use crate::test_size::trials;

/// Pages, parts of pages, pictures and data, each for every client in every trial.
const PATHS: [&str; 25] = [
    "/",
    "/import",
    "/restore",
    "/p/p/",
    "/p/p/pairs",
    "/p/p/pairs?view=table&compare=density",
    "/p/p/pairs?state=aligned&sort=iou-down",
    "/p/p/pairs?state=retired",
    "/p/p/pairs/listed?state=aligned",
    "/p/p/pair/upright-0000/",
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
    "/p/p/export",
    "/p/p/settings?key=run.workers&value=3",
    "/p/p/health",
    "/p/p/last-import",
];
/// Clients at the same time.
const CLIENTS: usize = 8;
/// Most memory by which the peak may grow after every path was read twice by all clients, MiB. Each of 19,200 requests, as
/// `MOCBAN_TRIALS=100` sends them, may keep 3 kB.
const GROWTH_MIB: u64 = 64;

#[test]
fn the_memory_of_the_app_does_not_grow_with_the_number_of_requests() {
    let (_dir, page) = with_project();
    let site = &*page;
    let round = |trials: usize| {
        std::thread::scope(|scope| {
            for client in 0..CLIENTS {
                scope.spawn(move || {
                    for index in 0..trials * PATHS.len() {
                        // Each client is at another place of the list.
                        let path = PATHS[(index + 3 * client) % PATHS.len()];
                        assert_eq!(site.get(path).status, 200, "{path}");
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

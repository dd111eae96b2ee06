//! Measures precision and recall of the boxes that are found on generated pages:
//!
//! ```text
//! cargo bench --bench pages
//! MOCBAN_PAGES=sparse,library:1-20 MOCBAN_PAGES_DIR=/tmp/pages cargo bench --bench pages
//! ```
//!
//! `MOCBAN_PAGES` names kinds of blocks and the first and last seed. `MOCBAN_PAGES_DIR` keeps the registered pages, so that a
//! second run only finds boxes, and gets a picture of each page with its true boxes in green and the found ones in red.

mod overlay;
mod page;
mod tally;

use std::io::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use mocban_demo::block::BlockKind;

use page::RegisteredPage;
use tally::{PageTally, label_answers, sum_line};

/// Kinds and seeds without `MOCBAN_PAGES`: those of the development.
const DEVELOPMENT: &str =
    "plain,notes,coarse,tall-notes,broken-rules,sparse,registers,stamped,library:1-3";

fn main() {
    let asked = std::env::var("MOCBAN_PAGES").unwrap_or_else(|_| DEVELOPMENT.to_owned());
    let dir = std::env::var_os("MOCBAN_PAGES_DIR").map(PathBuf::from);
    let (kinds, seeds) = asked.split_once(':').expect("KIND,KIND:FIRST-LAST");
    let (first, last) = seeds.split_once('-').unwrap_or((seeds, seeds));
    let [first, last]: [u64; 2] = [first, last].map(|seed| seed.parse().expect("a seed"));
    let mut out = std::io::stdout();
    let mut all = Vec::new();
    // Right labels, mirrored ones and turned ones that are accepted.
    let mut accepted = [0; 3];
    for kind in kinds.split(',') {
        let kind: BlockKind = kind.parse().expect("a kind of block");
        let mut of_kind = Vec::new();
        for seed in first..=last {
            let Some(page) = RegisteredPage::of(kind, seed, dir.as_deref()) else {
                writeln!(out, "{kind} {seed}: refused by `align`").expect("written");
                continue;
            };
            let start = Instant::now();
            let found = page.find();
            let seconds = start.elapsed().as_secs_f64();
            let tally = PageTally::of(&page, &found);
            for (count, is_accepted) in accepted.iter_mut().zip(label_answers(&page)) {
                *count += u32::from(is_accepted);
            }
            writeln!(out, "{kind} {seed}: {} {seconds:.2} s", tally.line()).expect("written");
            if let Some(dir) = &dir {
                overlay::write(&page, &found, &dir.join(format!("{kind}-{seed}.png")));
            }
            of_kind.push(tally);
        }
        writeln!(out, "{}", sum_line(&kind.to_string(), &of_kind)).expect("written");
        all.extend(of_kind);
    }
    let [right, mirrored, turned] = accepted;
    writeln!(
        out,
        "{}\n== labels of {} pages that are accepted: {right} right, {mirrored} mirrored, {turned} turned",
        sum_line("sum", &all),
        all.len()
    )
    .expect("written");
}

//! Parallel work with results in the order of the items.

use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::ProgressBar;

/// Runs `work` on each number below `count` and returns the results in order. A single thread computes each item, so
/// the thread's processor time is the time of the item.
pub(super) fn in_order<T: Send>(
    count: usize,
    workers: NonZeroUsize,
    work: impl Fn(usize) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let (next, bar) = (AtomicUsize::new(0), ProgressBar::new(count as u64));
    let drain = || -> anyhow::Result<Vec<(usize, T)>> {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return Ok(done);
            }
            done.push((index, work(index)?));
            bar.inc(1);
        }
    };
    let mut done = Vec::new();
    std::thread::scope(|scope| -> anyhow::Result<()> {
        let start = |_| scope.spawn(|| alone(drain)?);
        let threads: Vec<_> = (0..workers.get()).map(start).collect();
        for thread in threads {
            done.extend(thread.join().unwrap_or_else(|panic| resume_unwind(panic))?);
        }
        Ok(())
    })?;
    bar.finish_and_clear();
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// Runs work in a thread pool of one thread.
fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> anyhow::Result<T> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    Ok(pool.install(work))
}

//! Reads input files on separate threads. If a disk or network hangs, the run can still continue and handle signals.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;
use tokio::time::sleep;

use super::options::RunOptions;
use super::stop::{Stop, StopLevel};
use mocban_system::platform::ActiveClock;

/// Reads in progress at the same time, not counting overdue reads.
pub(super) const THREADS: usize = 8;
/// After this many reads that hang, the remaining ones are given up.
pub(super) const MAX_HANGING: usize = 64;
/// A file that takes longer than this is named to the user.
const SLOW: Duration = Duration::from_secs(10);
/// Longest time between two readings of the clock.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// Conditions under which a read is abandoned. Its thread stays until the system call returns.
#[derive(Debug, Clone)]
pub(super) struct ReadLimits {
    /// Longest time for one item.
    pub(super) timeout: Duration,
    /// The run's stop request.
    pub(super) stop: Stop,
    /// Level of the request at which waiting ends.
    pub(super) until: StopLevel,
}

/// Returns the limits for reads that take place before the first stage. Any stop request ends these reads, because no
/// stage is in progress.
pub(super) fn read_limits(options: &RunOptions, stop: &Stop) -> ReadLimits {
    ReadLimits {
        timeout: options.stage_timeout,
        stop: stop.clone(),
        until: StopLevel::Drain,
    }
}

/// Something that is read from files.
pub(super) trait ReadItem: Send + Sync + 'static {
    /// What is read.
    type Output: Send;

    /// Reads it. May block.
    fn read(&self) -> Self::Output;

    /// Returns the first file that it reads, for messages.
    fn path(&self) -> PathBuf;
}

/// Reads items on several threads. Returns the outputs in the order of the items. The output of an item is `None` if
/// its read took longer than the timeout, or if a stop was requested first.
pub(super) async fn read_each<T: ReadItem>(
    items: Vec<T>,
    limits: &ReadLimits,
) -> Vec<Option<T::Output>> {
    let mut outputs: Vec<_> = items.iter().map(|_| None).collect();
    if items.is_empty() {
        return outputs;
    }
    let (sender, mut progress) = mpsc::unbounded_channel();
    let readers = Readers {
        queue: Arc::new(ReadQueue {
            items,
            next: AtomicUsize::new(0),
        }),
        sender,
    };
    (0..THREADS.min(outputs.len())).for_each(|_| readers.start_thread());
    let mut pending = PendingReads::new(limits.timeout);
    let stopped = limits.stop.reached(limits.until);
    tokio::pin!(stopped);
    while pending.ended < outputs.len() && pending.hanging < MAX_HANGING {
        tokio::select! {
            biased;
            Some(event) = progress.recv() => match event {
                ReadEvent::Started(at) => pending.start(at),
                ReadEvent::Ended(at, output) => {
                    pending.end(at);
                    outputs[at] = Some(output);
                }
            },
            () = &mut stopped => break,
            () = sleep(pending.until_check().min(LONGEST_SLEEP)) => {
                let path_of = |at: usize| readers.queue.items[at].path();
                for _ in 0..pending.check(path_of) {
                    readers.start_thread();
                }
            }
        }
    }
    outputs
}

/// Items, of which each thread takes the next one.
struct ReadQueue<T> {
    items: Vec<T>,
    next: AtomicUsize,
}

/// What a thread reports, with the position of the item.
enum ReadEvent<R> {
    Started(usize),
    Ended(usize, R),
}

/// Starts the threads.
struct Readers<T: ReadItem> {
    queue: Arc<ReadQueue<T>>,
    sender: mpsc::UnboundedSender<ReadEvent<T::Output>>,
}

impl<T: ReadItem> Readers<T> {
    /// Starts a thread that reads items until the queue is empty. If no thread can start, `PendingReads::check` ends
    /// the wait.
    fn start_thread(&self) {
        let (queue, sender) = (Arc::clone(&self.queue), self.sender.clone());
        let work = move || {
            while let Some((at, item)) = queue.take() {
                // The receiver is gone after a stop.
                if sender.send(ReadEvent::Started(at)).is_err() {
                    return;
                }
                let _ = sender.send(ReadEvent::Ended(at, item.read()));
            }
        };
        let thread = std::thread::Builder::new().name("input files".to_owned());
        if let Err(error) = thread.spawn(work) {
            tracing::warn!(%error, "the system gave no thread to read input files");
        }
    }
}

impl<T> ReadQueue<T> {
    fn take(&self) -> Option<(usize, &T)> {
        let at = self.next.fetch_add(1, Ordering::Relaxed);
        Some((at, self.items.get(at)?))
    }
}

/// The reads in progress.
struct PendingReads {
    timeout: Duration,
    clock: ActiveClock,
    /// When each read started by the clock, by position.
    started: BTreeMap<usize, Duration>,
    /// When a read last started or ended, or was found overdue.
    last_event: Duration,
    /// Items whose read has returned or is overdue.
    ended: usize,
    /// Items whose read is overdue.
    hanging: usize,
    is_slow_reported: bool,
}

impl PendingReads {
    fn new(timeout: Duration) -> Self {
        Self {
            timeout,
            clock: ActiveClock::start(2 * LONGEST_SLEEP),
            started: BTreeMap::new(),
            last_event: Duration::ZERO,
            ended: 0,
            hanging: 0,
            is_slow_reported: false,
        }
    }

    fn start(&mut self, at: usize) {
        self.last_event = self.clock.now();
        self.started.insert(at, self.last_event);
    }

    fn end(&mut self, at: usize) {
        self.last_event = self.clock.now();
        // An overdue read may still return; it was counted before.
        if self.started.remove(&at).is_some() {
            self.ended += 1;
        }
    }

    /// Returns the start of the longest read in progress.
    fn oldest(&self) -> Duration {
        let oldest = self.started.values().min();
        oldest.copied().unwrap_or(self.last_event)
    }

    /// Returns the time until slow and overdue reads are looked for.
    fn until_check(&mut self) -> Duration {
        let wait = if self.is_slow_reported {
            self.timeout
        } else {
            self.timeout.min(SLOW)
        };
        (self.oldest() + wait).saturating_sub(self.clock.now())
    }

    /// Reports the first slow read and every overdue one. Returns how many became overdue since the last call.
    fn check(&mut self, path_of: impl Fn(usize) -> PathBuf) -> usize {
        if !self.until_check().is_zero() {
            return 0;
        }
        let (now, timeout) = (self.clock.now(), self.timeout);
        if self.started.is_empty() {
            // No thread has reported anything for so long: none could be started.
            self.hanging = MAX_HANGING;
            return 0;
        }
        let is_overdue = |_: &usize, since: &mut Duration| now.saturating_sub(*since) >= timeout;
        let overdue: BTreeMap<_, _> = self.started.extract_if(.., is_overdue).collect();
        for at in overdue.keys() {
            report_overdue(&path_of(*at), timeout);
        }
        if !overdue.is_empty() {
            // The threads that replace the hanging ones need time to start.
            self.last_event = now;
        }
        self.ended += overdue.len();
        self.hanging += overdue.len();
        if !self.is_slow_reported
            && let Some((at, _)) = self.started.iter().min_by_key(|(_, since)| **since)
            && now.saturating_sub(self.oldest()) >= SLOW
        {
            self.is_slow_reported = true;
            report_slow(&path_of(*at), timeout);
        }
        overdue.len()
    }
}

fn report_slow(path: &Path, timeout: Duration) {
    let (path, limit) = (path.display(), timeout.as_secs_f64());
    tracing::warn!(
        "{path} does not answer; its disk or network may hang; waiting for at most {limit} s (run.stage_timeout_s)"
    );
}

fn report_overdue(path: &Path, timeout: Duration) {
    let (path, limit) = (path.display(), timeout.as_secs_f64());
    tracing::warn!("{path} did not answer within {limit} s; it counts as unchanged");
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::{Arc, Condvar, Mutex};
    use std::time::Duration;

    use super::{LONGEST_SLEEP, PendingReads, ReadItem, ReadLimits, SLOW, THREADS, read_each};
    use crate::stop::{Stop, StopLevel};
    use mocban_system::platform::ActiveClock;

    /// Opened when hanging reads may return.
    type Gate = Arc<(Mutex<bool>, Condvar)>;

    /// An item that returns its number, at once or when its gate opens.
    struct Item(usize, Option<Gate>);

    impl ReadItem for Item {
        type Output = usize;

        fn read(&self) -> usize {
            if let Some(gate) = &self.1 {
                let open = gate.0.lock().expect("an unpoisoned lock");
                drop(gate.1.wait_while(open, |open| !*open).expect("no panic"));
            }
            self.0
        }

        fn path(&self) -> PathBuf {
            PathBuf::from(self.0.to_string())
        }
    }

    fn open(gate: &Gate) {
        *gate.0.lock().expect("an unpoisoned lock") = true;
        gate.1.notify_all();
    }

    fn limits(timeout: Duration, stop: &Stop) -> ReadLimits {
        ReadLimits {
            timeout,
            stop: stop.clone(),
            until: StopLevel::Drain,
        }
    }

    #[tokio::test]
    async fn outputs_are_in_the_order_of_the_items() {
        let items: Vec<_> = (0..100).map(|number| Item(number, None)).collect();
        let limits = limits(Duration::from_mins(1), &Stop::new());
        let read = read_each(items, &limits).await;
        assert_eq!(read, (0..100).map(Some).collect::<Vec<_>>());
        assert!(read_each(Vec::<Item>::new(), &limits).await.is_empty());
    }

    /// More reads hang than there are threads.
    #[tokio::test]
    async fn reads_that_hang_are_given_up_and_the_others_are_done() {
        let gate = Gate::default();
        let hangs = |number: usize| number < THREADS + 2;
        let item = |number| Item(number, hangs(number).then(|| Arc::clone(&gate)));
        let items: Vec<_> = (0..40).map(item).collect();
        let limits = limits(Duration::from_secs(5), &Stop::new());
        let read = read_each(items, &limits).await;
        let wanted = (0..40).map(|number| (!hangs(number)).then_some(number));
        assert_eq!(read, wanted.collect::<Vec<_>>());
        open(&gate);
    }

    #[test]
    fn threads_that_replace_hanging_ones_have_time_to_start() {
        let timeout = Duration::from_secs(5);
        let mut pending = PendingReads::new(timeout);
        pending.start(0);
        pending.clock = ActiveClock::continued(2 * LONGEST_SLEEP, timeout + SLOW);
        assert_eq!(pending.check(|_| PathBuf::new()), 1);
        assert!(!pending.until_check().is_zero());
    }

    #[test]
    fn reads_are_not_overdue_because_the_process_was_suspended() {
        let mut pending = PendingReads::new(Duration::from_secs(5));
        pending.start(0);
        pending.clock = ActiveClock::continued(Duration::ZERO, Duration::from_secs(4));
        assert_eq!(pending.check(|_| PathBuf::new()), 0);
        assert!(pending.until_check() < Duration::from_secs(2));
        assert_eq!(pending.ended, 0);
    }

    #[tokio::test]
    async fn a_stop_ends_waiting_for_a_read() {
        let (gate, stop) = (Gate::default(), Stop::new());
        let items = vec![Item(0, Some(Arc::clone(&gate)))];
        let limits = limits(Duration::from_hours(1), &stop);
        let (read, level) = tokio::join!(read_each(items, &limits), async { stop.escalate() });
        assert_eq!((read, level), (vec![None], StopLevel::Drain));
        open(&gate);
    }
}

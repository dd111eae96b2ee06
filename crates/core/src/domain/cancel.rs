//! Cancellation of long computations: their inner loops poll a flag that the owner of the computation may set.
//!
//! The flag belongs to the thread that computes, so that pure functions need no parameter for it. A cancelled
//! computation unwinds to [`CancelToken::run`] without a panic message. Without a token, polling does nothing.

use std::cell::RefCell;
use std::io::{self, BufRead, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// Items of a loop between two polls. Loops that use it spend at most about a microsecond on an item.
const ITEMS_PER_POLL: u32 = 1 << 12;

/// The payload of the unwinding, and the result of a cancelled computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cancelled;

/// Cancels a computation from another thread. Clones share one flag.
#[derive(Debug, Clone, Default)]
pub struct CancelToken(Arc<CancelState>);

#[derive(Debug, Default)]
struct CancelState {
    is_cancelled: AtomicBool,
    #[cfg(any(test, feature = "test-helpers"))]
    probe: probe::PollProbe,
}

thread_local! {
    /// The token of the computation of this thread.
    static CURRENT: RefCell<Option<CancelToken>> = const { RefCell::new(None) };
}

impl CancelToken {
    /// Requests that the computation ends. It notices within milliseconds, unless it waits for a file.
    pub fn cancel(&self) {
        self.0.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Returns the flag, for code that reports the cancellation itself.
    pub fn flag(&self) -> &AtomicBool {
        &self.0.is_cancelled
    }

    /// Runs a computation that polls this token.
    ///
    /// # Errors
    /// Returns an error if the computation was cancelled before it ended.
    pub fn run<T>(&self, work: impl FnOnce() -> T) -> Result<T, Cancelled> {
        let token = ThreadToken(Some(self.clone()));
        catch_unwind(AssertUnwindSafe(|| token.scope(work))).map_err(|payload| {
            payload
                .downcast()
                .map_or_else(|panic| resume_unwind(panic), |cancelled| *cancelled)
        })
    }
}

/// Cancels a computation when it is dropped.
#[derive(Debug)]
pub struct CancelGuard(pub CancelToken);

impl Drop for CancelGuard {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

/// The token of a thread, to be used on the threads that it hands work to. May be empty.
#[derive(Debug, Clone)]
pub struct ThreadToken(Option<CancelToken>);

impl ThreadToken {
    /// Returns the token of the current thread.
    pub fn current() -> Self {
        Self(CURRENT.with_borrow(Clone::clone))
    }

    /// Runs a part of the computation, on any thread. A cancellation unwinds out of it.
    pub fn scope<T>(&self, work: impl FnOnce() -> T) -> T {
        let _previous = PreviousToken(CURRENT.replace(self.0.clone()));
        poll();
        work()
    }
}

/// Sets the token of a thread back at the end of a scope, even if the scope unwinds.
struct PreviousToken(Option<CancelToken>);

impl Drop for PreviousToken {
    fn drop(&mut self) {
        CURRENT.set(self.0.take());
    }
}

/// Unwinds if the computation of this thread was cancelled. Takes about a nanosecond. Must not be called while a value
/// is dropped.
#[inline]
pub fn poll() {
    let is_cancelled = CURRENT.with_borrow(|token| {
        token.as_ref().is_some_and(|CancelToken(state)| {
            #[cfg(any(test, feature = "test-helpers"))]
            state.probe.count(&state.is_cancelled);
            state.is_cancelled.load(Ordering::Relaxed)
        })
    });
    if is_cancelled {
        resume_unwind(Box::new(Cancelled));
    }
}

/// Time between two polls of a thread that waits for another one.
const WAITING_POLL: Duration = Duration::from_millis(5);

/// Runs work that polls too rarely on a thread of its own, and polls while it waits for the result. After a
/// cancellation, that thread ends at its next poll or at the end of the work.
///
/// Returns `None`, and does not run the work, if nobody can cancel this computation or if no thread can be started.
pub(crate) fn run_aside<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
    let token = ThreadToken::current();
    token.0.as_ref()?;
    let (running, ended) = mpsc::channel::<()>();
    let work = move || {
        let _running = running;
        token.scope(work)
    };
    let thread = thread::Builder::new().spawn(work).ok()?;
    while ended.recv_timeout(WAITING_POLL) == Err(RecvTimeoutError::Timeout) {
        poll();
    }
    Some(thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
}

/// Polls at every 4,096th item of a loop.
#[derive(Debug, Default)]
pub struct PollCounter(u32);

impl PollCounter {
    /// Counts an item.
    #[inline]
    pub fn tick(&mut self) {
        self.add(1);
    }

    /// Counts several items.
    #[inline]
    pub fn add(&mut self, items: u32) {
        self.0 += items;
        if self.0 >= ITEMS_PER_POLL {
            self.0 = 0;
            poll();
        }
    }
}

/// Iterates over items and polls now and then.
#[inline]
pub fn polled<I: IntoIterator>(items: I) -> impl Iterator<Item = I::Item> {
    let mut counter = PollCounter::default();
    items.into_iter().inspect(move |_| counter.tick())
}

/// Polls each time that a decoder reads from a source.
#[derive(Debug)]
pub(crate) struct PolledReader<R>(pub(crate) R);

impl<R: Read> Read for PolledReader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        poll();
        self.0.read(bytes)
    }
}

impl<R: BufRead> BufRead for PolledReader<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        poll();
        self.0.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.0.consume(amount);
    }
}

impl<R: Seek> Seek for PolledReader<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

/// Counts polls in tests, and cancels at one of them.
#[cfg(any(test, feature = "test-helpers"))]
mod probe {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

    use super::{CancelState, CancelToken};

    #[derive(Debug, Default)]
    pub(super) struct PollProbe {
        polls: AtomicU64,
        /// The poll that cancels, from 1; 0 for none.
        cancels_at: u64,
    }

    impl PollProbe {
        pub(super) fn count(&self, is_cancelled: &AtomicBool) {
            let polls = self.polls.fetch_add(1, Ordering::Relaxed) + 1;
            if polls == self.cancels_at {
                is_cancelled.store(true, Ordering::Relaxed);
            }
        }
    }

    impl CancelToken {
        /// Creates a token that is cancelled at a poll, counted from 1.
        pub fn cancelled_at(poll: u64) -> Self {
            Self(Arc::new(CancelState {
                probe: PollProbe {
                    cancels_at: poll,
                    ..PollProbe::default()
                },
                ..CancelState::default()
            }))
        }

        /// Returns how often the computation polled.
        pub fn polls(&self) -> u64 {
            self.0.probe.polls.load(Ordering::Relaxed)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;
    use std::sync::mpsc;

    use super::{CancelToken, Cancelled, PolledReader, ThreadToken, poll, polled, run_aside};

    #[test]
    fn a_computation_ends_at_its_next_poll_and_not_without_a_token() {
        let token = CancelToken::default();
        assert_eq!(token.run(|| 7), Ok(7));
        token.cancel();
        assert_eq!(token.run(|| polled(0..).count()), Err(Cancelled));
        poll();
        assert_eq!(polled(0..9000).count(), 9000);
    }

    #[test]
    fn a_cancellation_from_another_thread_ends_an_endless_loop() {
        let token = CancelToken::default();
        let (started, start) = mpsc::channel();
        let inner = token.clone();
        let thread = std::thread::spawn(move || {
            inner.run(|| {
                started.send(()).expect("a receiver");
                polled(std::iter::repeat(())).for_each(drop);
            })
        });
        start.recv().expect("it starts");
        token.cancel();
        assert_eq!(thread.join().expect("no panic"), Err(Cancelled));
    }

    #[test]
    fn the_token_goes_along_to_other_threads_and_ends_with_its_scope() {
        let token = CancelToken::cancelled_at(4);
        let ended = token.run(|| {
            let here = ThreadToken::current();
            let there = std::thread::scope(|threads| {
                let polls = || here.scope(poll);
                threads.spawn(polls).join().expect("not cancelled yet");
                threads.spawn(polls).join()
            });
            there.is_err_and(|payload| payload.is::<Cancelled>())
        });
        assert_eq!(
            ended,
            Ok(true),
            "the scopes polled twice each, the run once"
        );
        poll();
    }

    #[test]
    fn other_panics_come_through() {
        let token = CancelToken::default();
        let caught =
            std::panic::catch_unwind(|| token.run(|| std::panic::resume_unwind(Box::new(7_i32))));
        assert_eq!(caught.expect_err("a panic").downcast_ref(), Some(&7_i32));
    }

    #[test]
    fn a_decoder_ends_when_it_reads_on() {
        let token = CancelToken::cancelled_at(3);
        let mut bytes = [0; 1];
        let read = token.run(|| {
            let mut source = PolledReader(std::io::repeat(7));
            while source.read(&mut bytes).is_ok() {}
        });
        assert_eq!(read, Err(Cancelled));
        assert_eq!(token.polls(), 3);
    }

    #[test]
    fn a_cancellation_ends_the_wait_for_work_that_does_not_poll() {
        let token = CancelToken::default();
        let (inner, (started, start)) = (token.clone(), mpsc::channel());
        let (release, released) = mpsc::channel::<()>();
        let thread = std::thread::spawn(move || {
            inner.run(|| {
                run_aside(move || {
                    started.send(()).expect("a receiver");
                    released.recv().is_err()
                })
            })
        });
        start.recv().expect("it starts");
        token.cancel();
        assert_eq!(thread.join().expect("no panic"), Err(Cancelled));
        drop(release);
    }

    #[test]
    fn work_aside_gives_its_result_its_panic_or_its_cancellation() {
        let token = CancelToken::default();
        assert_eq!(token.run(|| run_aside(|| 7)), Ok(Some(7)));
        assert_eq!(run_aside(|| 7), None, "nobody can cancel it");
        let failing = || run_aside(|| std::panic::resume_unwind(Box::new(7_i32)));
        let caught = std::panic::catch_unwind(|| token.run::<Option<()>>(failing));
        assert_eq!(caught.expect_err("a panic").downcast_ref(), Some(&7_i32));
        let token = CancelToken::cancelled_at(100);
        let endless = || run_aside(|| polled(std::iter::repeat(())).for_each(drop));
        assert_eq!(token.run(endless), Err(Cancelled));
    }
}

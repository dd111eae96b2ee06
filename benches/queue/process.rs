//! The program as a process of its own: how long it takes and how much memory it needs.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use rustix::time::{ClockId, clock_gettime};

/// Between two looks at a process's memory.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// What a process needed.
#[derive(Debug, Clone)]
pub(super) struct Needed {
    /// From start to end.
    pub(super) time: Duration,
    /// Most memory it held at a time, MiB.
    pub(super) mib: f64,
    /// What it wrote to its standard output.
    pub(super) stdout: String,
}

/// Runs the program itself.
pub(super) fn mocban<A: AsRef<OsStr>>(args: &[A]) -> anyhow::Result<Needed> {
    run(Command::new(env!("CARGO_BIN_EXE_mocban")).args(args))
}

/// Runs a command that must go well.
pub(super) fn run(command: &mut Command) -> anyhow::Result<Needed> {
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("cannot start {command:?}"))?;
    let mut stdout = child.stdout.take().context("a pipe that was asked for")?;
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        stdout.read_to_string(&mut text).map(|_| text)
    });
    let who = child.id().to_string();
    let mut mib = 0.0_f64;
    let status = loop {
        mib = mib.max(peak_mib(&who).unwrap_or(0.0));
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(LOOK_EVERY);
    };
    let time = start.elapsed();
    anyhow::ensure!(status.success(), "{command:?} ended with {status}");
    let stdout = reader.join().ok().context("lost a pipe")??;
    Ok(Needed { time, mib, stdout })
}

/// Most memory that a process ever held, MiB; `self` is this one.
pub(super) fn peak_mib(process: &str) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Begins this process's own peak anew.
pub(super) fn forget_peak() {
    // Where that is refused the peak is that of the whole life, which is no less.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Time that this process has had of all cores, its threads that have ended included.
pub(super) fn time_of_cores() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// Nanoseconds that each thread of this process has had of a core, by its number; of those that live.
pub(super) fn time_of_threads() -> anyhow::Result<BTreeMap<OsString, u64>> {
    let mut times = BTreeMap::new();
    for entry in std::fs::read_dir("/proc/self/task")? {
        let entry = entry?;
        // It may have ended meanwhile.
        let Ok(text) = std::fs::read_to_string(entry.path().join("schedstat")) else {
            continue;
        };
        let time = text.split_whitespace().next().context("a number")?;
        times.insert(entry.file_name(), time.parse()?);
    }
    Ok(times)
}

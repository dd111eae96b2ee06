//! Runs the program as a separate process and measures its time and memory.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use rustix::time::{ClockId, clock_gettime};

/// Interval between samples of the memory of a process.
const SAMPLE_EVERY: Duration = Duration::from_millis(2);

/// Time, memory and output of a process.
#[derive(Debug, Clone)]
pub(super) struct ProcessUsage {
    /// From start to end.
    pub(super) time: Duration,
    /// Peak memory in MiB.
    pub(super) mib: f64,
    /// Its standard output.
    pub(super) stdout: String,
}

/// Runs the program itself.
pub(super) fn mocban<A: AsRef<OsStr>>(args: &[A]) -> anyhow::Result<ProcessUsage> {
    run(Command::new(env!("CARGO_BIN_EXE_mocban")).args(args))
}

/// Runs a command that must succeed.
pub(super) fn run(command: &mut Command) -> anyhow::Result<ProcessUsage> {
    let start = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .with_context(|| format!("cannot start {command:?}"))?;
    let mut stdout = child.stdout.take().context("no pipe")?;
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
        std::thread::sleep(SAMPLE_EVERY);
    };
    let time = start.elapsed();
    anyhow::ensure!(status.success(), "{command:?} ended with {status}");
    let stdout = reader.join().ok().context("lost a pipe")??;
    Ok(ProcessUsage { time, mib, stdout })
}

/// Returns the peak memory of a process in MiB; `self` is this process.
pub(super) fn peak_mib(process: &str) -> Option<f64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

/// Resets the peak memory of this process.
pub(super) fn reset_peak() {
    // If this write is not permitted, the peak covers the whole life of the process.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Returns the CPU time of this process, ended threads included.
pub(super) fn cpu_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// Returns the CPU time of each living thread of this process in nanoseconds, by thread id.
pub(super) fn thread_cpu_times() -> anyhow::Result<BTreeMap<OsString, u64>> {
    let mut times = BTreeMap::new();
    for entry in std::fs::read_dir("/proc/self/task")? {
        let entry = entry?;
        // The thread may have ended meanwhile.
        let Ok(text) = std::fs::read_to_string(entry.path().join("schedstat")) else {
            continue;
        };
        let time = text.split_whitespace().next().context("a number")?;
        times.insert(entry.file_name(), time.parse()?);
    }
    Ok(times)
}

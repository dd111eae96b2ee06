//! Runs as processes of their own, which go on when the app ends, and their stop.

use std::ffi::OsStr;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use super::failure::{AppFailure, AppResult};
use mocban_catalog::{Catalog, WorkerRecord, WorkerState};
use mocban_project::ExitCode;
use mocban_project::location::now;
use mocban_system::platform;

/// How long a started run is watched for an error at its beginning.
const WATCHED: Duration = Duration::from_millis(1500);
/// Workers without a heartbeat for longer are not looked at, in milliseconds.
const RECENT_MS: i64 = 3_600_000;
/// Most bytes of the messages of a run that are shown.
const MESSAGE_BYTES: u64 = 4096;

/// Starts `run` for a project with more arguments. Returns once it works, or has ended at once without an error.
///
/// # Errors
/// Returns the last message of a run that ended with an error at its beginning.
pub(super) async fn start(program: &Path, dir: &Path, args: &[String]) -> AppResult<()> {
    let failed =
        |error: std::io::Error| AppFailure::refused(format!("the run cannot start: {error}"));
    // The file has no name, so nothing stays if the app is killed.
    let mut messages = tempfile::tempfile().map_err(failed)?;
    let mut command = Command::new(program);
    command
        .arg("-C")
        .arg(dir)
        .args(["--color", "never", "--progress", "none", "run"])
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(messages.try_clone().map_err(failed)?);
    platform::detach(&mut command);
    let mut child = command.spawn().map_err(failed)?;
    let (ended, ends) = tokio::sync::oneshot::channel();
    // Waits for the process, so that it does not stay as a zombie.
    std::thread::spawn(move || {
        if let Ok(status) = child.wait() {
            let _ = ended.send(status);
        }
    });
    let Ok(Ok(status)) = tokio::time::timeout(WATCHED, ends).await else {
        return Ok(());
    };
    if is_success(status) {
        return Ok(());
    }
    let mut text = String::new();
    let read = messages
        .seek(SeekFrom::Start(0))
        .and_then(|_| messages.take(MESSAGE_BYTES).read_to_string(&mut text));
    read.map_err(failed)?;
    Err(AppFailure::refused(last_error(&text)))
}

/// Runs a command to its end.
///
/// # Errors
/// Returns its last message if it ended with an error.
pub(super) async fn finish(program: &Path, args: &[&OsStr]) -> AppResult<()> {
    let mut command = Command::new(program);
    command
        .args(["--color", "never", "--progress", "none"])
        .args(args);
    command.stdin(Stdio::null());
    let ended = tokio::task::spawn_blocking(move || command.output()).await;
    let failed = |error: String| AppFailure::refused(format!("the command cannot start: {error}"));
    let output = ended.map_err(|error| failed(error.to_string()))?;
    let output = output.map_err(|error| failed(error.to_string()))?;
    if is_success(output.status) {
        return Ok(());
    }
    Err(AppFailure::refused(last_error(&String::from_utf8_lossy(
        &output.stderr,
    ))))
}

/// Returns whether a run did its work, also if pairs failed.
fn is_success(status: ExitStatus) -> bool {
    let codes = [ExitCode::Done, ExitCode::SomeFailed];
    status
        .code()
        .is_some_and(|code| codes.iter().any(|known| *known as i32 == code))
}

/// Returns the error in the messages of a command.
fn last_error(text: &str) -> String {
    let lines = text.lines().map(|line| line.trim_start_matches("error: "));
    let mut lines = lines.filter(|line| !line.starts_with("next:") && !line.is_empty());
    lines
        .next_back()
        .unwrap_or("the run ended without a message")
        .to_owned()
}

/// Returns the workers that work on a project now.
pub(super) async fn workers(catalog: &Catalog) -> AppResult<Vec<WorkerRecord>> {
    let now = now();
    let mut workers = catalog.workers(now - RECENT_MS).await?;
    workers.retain(|worker| {
        matches!(
            worker.state(now),
            WorkerState::Alive | WorkerState::Stopping
        )
    });
    Ok(workers)
}

/// Asks the runs of this computer to finish the stages in progress and to stop, or to stop at once if they were asked
/// before. This is what Ctrl-C does in a terminal.
///
/// # Errors
/// Returns an error if no run of this computer works on the project.
pub(super) async fn stop(catalog: &Catalog) -> AppResult<()> {
    let host = platform::host_name();
    let workers = workers(catalog).await?;
    let here = workers.iter().filter(|worker| worker.host == host);
    let mut stopped = 0;
    for worker in here {
        if platform::interrupt(worker.pid).is_ok() {
            stopped += 1;
        }
    }
    if stopped > 0 {
        return Ok(());
    }
    Err(AppFailure::refused(match workers.first() {
        Some(worker) => format!("the run is on the computer {}: stop it there", worker.host),
        None => "no run works on this project".to_owned(),
    }))
}

#[cfg(test)]
mod tests {
    use super::last_error;

    #[test]
    fn the_error_of_a_run_is_shown_without_its_advice() {
        let text = "warning: x\nerror: the project is in use by process 7\nnext: mocban status\n";
        assert_eq!(last_error(text), "the project is in use by process 7");
        assert_eq!(last_error(""), "the run ended without a message");
    }
}

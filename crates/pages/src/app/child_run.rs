//! Runs as processes of their own, which go on when the app ends, and their stop.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use super::failed_runs::FailedRuns;
use super::failure::{AppFailure, AppResult};
use super::process_end::reason_of_end;
use super::sentence::{Sentence, system_reasons, without_commands};
use super::state::AppState;
use crate::messages;
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

/// Starts `run` for a project with more arguments, for the pairs with these ids or for all. Returns once it works, or has
/// ended at once without an error. The state keeps the reason of a failure.
///
/// # Errors
/// Returns the last message of a run that ended with an error at its beginning.
pub(super) async fn start(
    state: &AppState,
    dir: &Path,
    args: &[String],
    names: &[String],
) -> AppResult<()> {
    let failed = |error: io::Error| {
        let [english, vietnamese] = system_reasons(&error);
        AppFailure::refused(Sentence::new(
            format!("the run cannot start: {english}"),
            format!("không bắt đầu chạy được: {vietnamese}"),
        ))
    };
    state.failed_runs.set(dir, None);
    // The file has no name, so nothing stays if the app is killed.
    let messages = tempfile::tempfile().map_err(failed)?;
    let mut command = run_command(&state.options.program, dir, args, names).map_err(failed)?;
    command
        .stdout(Stdio::null())
        .stderr(messages.try_clone().map_err(failed)?);
    platform::detach(&mut command);
    let mut child = command.spawn().map_err(failed)?;
    let (ended, mut ends) = tokio::sync::oneshot::channel();
    // Waits for the process, so that it does not stay as a zombie.
    std::thread::spawn(move || {
        if let Ok(status) = child.wait() {
            let _ = ended.send(status);
        }
    });
    match tokio::time::timeout(WATCHED, &mut ends).await {
        Ok(Ok(status)) => {
            let failed = failure(status, messages);
            store(&state.failed_runs, dir, status, failed.as_ref());
            failed.map_or(Ok(()), |why| Err(AppFailure::refused(why)))
        }
        Ok(Err(_)) => Ok(()),
        Err(_) => {
            let (runs, dir) = (state.failed_runs.clone(), dir.to_owned());
            tokio::spawn(async move {
                if let Ok(status) = ends.await {
                    store(&runs, &dir, status, failure(status, messages).as_ref());
                }
            });
            Ok(())
        }
    }
}

/// Stores why a run failed, or that it did not. If it found another run at work, which may still fail, stores nothing.
fn store(runs: &FailedRuns, dir: &Path, status: ExitStatus, why: Option<&Sentence>) {
    if status.code() != Some(ExitCode::InUse as i32) {
        runs.set(dir, why.cloned());
    }
}

/// Returns the command of a run. It reads ids from its standard input, because the arguments of a command are limited: to
/// 32,767 characters on Windows.
fn run_command(
    program: &Path,
    dir: &Path,
    args: &[String],
    names: &[String],
) -> io::Result<Command> {
    let mut command = Command::new(program);
    command
        .arg("-C")
        .arg(dir)
        .args(["--color", "never", "--progress", "none", "run"])
        .args(args);
    if names.is_empty() {
        command.stdin(Stdio::null());
    } else {
        command.args(["--names-from", "-"]).stdin(name_file(names)?);
    }
    Ok(command)
}

/// Returns a file without a path that has one id a line and is read from its beginning.
fn name_file(names: &[String]) -> io::Result<File> {
    let mut file = tempfile::tempfile()?;
    file.write_all(names.join("\n").as_bytes())?;
    file.rewind()?;
    Ok(file)
}

/// Returns why a run failed, or `None` if it did its work or was asked to stop.
fn failure(status: ExitStatus, messages: File) -> Option<Sentence> {
    if is_success(status) || status.code() == Some(ExitCode::Stopped as i32) {
        return None;
    }
    let bytes = last_bytes(messages).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    if let Some([english, vietnamese]) = reason_of_end(status, &text) {
        return Some(Sentence::new(
            format!("The run ended before its work was done: {english}. Press Align to go on."),
            format!(
                "Lần chạy kết thúc trước khi làm xong: {vietnamese}. Hãy bấm Căn chỉnh để chạy tiếp."
            ),
        ));
    }
    Some(why(&last_error(&text)))
}

fn why(message: &str) -> Sentence {
    let plain = without_commands(message);
    let vietnamese = messages::vietnamese(&plain).unwrap_or_else(|| plain.clone());
    Sentence::new(
        format!("The run failed: {plain}"),
        format!("Lần chạy bị lỗi: {vietnamese}"),
    )
}

/// Reads the end of the messages of a run.
fn last_bytes(mut messages: File) -> std::io::Result<Vec<u8>> {
    let length = messages.metadata()?.len();
    messages.seek(SeekFrom::Start(length.saturating_sub(MESSAGE_BYTES)))?;
    let mut bytes = Vec::new();
    messages.take(MESSAGE_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
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
    let failed = |error: io::Error| {
        let [english, vietnamese] = system_reasons(&error);
        AppFailure::refused(Sentence::new(
            format!("the program cannot start: {english}"),
            format!("không khởi động được chương trình: {vietnamese}"),
        ))
    };
    let output = ended.map_err(|error| failed(io::Error::other(error)))?;
    let output = output.map_err(failed)?;
    if is_success(output.status) {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    if let Some([english, vietnamese]) = reason_of_end(output.status, &text) {
        return Err(AppFailure::refused(Sentence::new(
            format!("the program ended before its work was done: {english}; try again"),
            format!("chương trình kết thúc trước khi làm xong: {vietnamese}; hãy thử lại"),
        )));
    }
    Err(AppFailure::refused(Sentence::of_program(&last_error(
        &text,
    ))))
}

/// Returns whether a run did its work, also if pairs failed.
fn is_success(status: ExitStatus) -> bool {
    let codes = [ExitCode::Done, ExitCode::SomeFailed];
    status
        .code()
        .is_some_and(|code| codes.iter().any(|known| *known as i32 == code))
}

/// Returns the last error in the messages of a command, or else its last message.
fn last_error(text: &str) -> String {
    let is_message = |line: &&str| !line.starts_with("next:") && !line.is_empty();
    let mut errors = text.lines().filter_map(|line| line.strip_prefix("error: "));
    let last = errors.next_back();
    let last = last.or_else(|| text.lines().rfind(is_message));
    last.unwrap_or("the run ended without a message").to_owned()
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
        Some(WorkerRecord { host, .. }) => Sentence::new(
            format!("the run is on the computer {host}: stop it there"),
            format!("lần chạy ở trên máy {host}: hãy dừng nó ở đó"),
        ),
        None => Sentence::new(
            "no run works on this project",
            "không có lần chạy nào trên dự án này",
        ),
    }))
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;
    use std::path::Path;

    #[cfg(unix)]
    use super::{ExitCode, ExitStatus, FailedRuns, store};
    use super::{last_error, name_file, run_command, why};
    use crate::review::Language;

    #[test]
    fn a_run_gets_ids_from_a_file_and_none_as_arguments() {
        let names: Vec<String> = (0..1000).map(|id| format!("-ván {id:0190}")).collect();
        let args = ["--rerun", "all"].map(str::to_owned);
        let command = run_command(Path::new("mocban"), Path::new("p"), &args, &names);
        let command = command.expect("a command");
        let given: Vec<&str> = command.get_args().filter_map(|arg| arg.to_str()).collect();
        assert!(given.ends_with(&["run", "--rerun", "all", "--names-from", "-"]));
        let mut text = String::new();
        let mut file = name_file(&names).expect("a file");
        file.read_to_string(&mut text).expect("UTF-8");
        assert!(text.lines().eq(names.iter().map(String::as_str)));
        let all = run_command(Path::new("mocban"), Path::new("p"), &args, &[]);
        let all = all.expect("a command");
        assert!(all.get_args().all(|arg| arg != "--names-from"));
    }

    #[cfg(unix)]
    #[test]
    fn a_run_that_finds_another_one_at_work_is_no_failed_run() {
        use std::os::unix::process::ExitStatusExt as _;
        let (runs, dir) = (FailedRuns::default(), Path::new("p"));
        let ends_with = |code: ExitCode| {
            let status = ExitStatus::from_raw((code as i32) << 8);
            store(&runs, dir, status, Some(&why("the reason")));
            runs.last(dir)
        };
        assert_eq!(ends_with(ExitCode::InUse), None);
        assert!(ends_with(ExitCode::Error).is_some());
    }

    #[test]
    fn the_error_of_a_run_is_shown_without_its_advice() {
        let failed = why("no catalog at p; `mocban import` creates it");
        let text = failed.text(Language::Vietnamese);
        assert_eq!(text, "Lần chạy bị lỗi: no catalog at p");
        let text = "warning: x\nerror: the project is in use by process 7\nnext: mocban status\n";
        assert_eq!(last_error(text), "the project is in use by process 7");
        let later = "error: no file a.stl\n2 pairs failed:\n  a  fit\nnext: mocban status\n";
        assert_eq!(last_error(later), "no file a.stl");
        assert_eq!(last_error("panicked at x\n"), "panicked at x");
        assert_eq!(last_error(""), "the run ended without a message");
    }
}

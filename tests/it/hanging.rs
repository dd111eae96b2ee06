//! Reads of input files that hang, as on a network file system without a server, and inputs that became pipes.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mocban::domain::{FailureClass, JobStatus};
use mocban::store::Project;
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::Signal;

use crate::cli::{binary, call, mocban};
use crate::fault::Fault;
use crate::processes::Running;
use crate::resume::{pairs, project, run, run_with_progress};

/// Longer than any test.
const HOUR_MS: u32 = 3_600_000;
const MESH: &str = "p/data/meshes/upright-0000.ply";
const PRINT: &str = "p/data/prints/upright-0000.jpg";

/// A project whose files can hang.
struct HangingDisk {
    project: Project,
    dir: tempfile::TempDir,
}

impl HangingDisk {
    fn new(pairs: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = project(dir.path(), "p", pairs);
        Self { project, dir }
    }

    /// Makes these calls on a file hang in a command.
    fn hang<'c>(
        &self,
        what: &'static str,
        file: &'static str,
        command: &'c mut Command,
    ) -> &'c mut Command {
        let fault = Fault::slow(what, file, HOUR_MS);
        fault.inject(1, self.dir.path(), self.dir.path(), command)
    }

    /// Starts a command and waits until a call hangs in it.
    fn start_hanging(
        &self,
        what: &'static str,
        file: &'static str,
        mut command: Command,
    ) -> Running {
        let notes = self.dir.path().join("injected");
        // The file is missing before the first command.
        let _ = std::fs::remove_file(&notes);
        let mut running = Running::start(self.hang(what, file, &mut command));
        running.wait_until("a call hangs", || notes.exists());
        running
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = binary();
        command.current_dir(self.dir.path()).arg("-C");
        command.arg(self.project.dir()).args(args);
        command
    }

    /// Replaces an input by a pipe without a writer.
    fn replace_by_pipe(&self, stored: &str) -> PathBuf {
        let path = self.project.input_path(stored);
        std::fs::remove_file(&path).expect("removed");
        let mode = Mode::RUSR | Mode::WUSR;
        mknodat(CWD, &path, FileType::Fifo, mode, 0).expect("a pipe");
        path
    }
}

#[test]
fn a_read_that_hangs_fails_its_pair_after_the_stage_limit() {
    // The limit is longer than a busy machine needs to come to the call.
    let fails = |call_kind: &'static str, file: &'static str| {
        let disk = HangingDisk::new("1");
        let mut command = run(&disk.project, &["--set", "run.stage_timeout_s=5"]);
        call(disk.hang(call_kind, file, &mut command)).expect(3);
        let pair = &pairs(&disk.project)[0];
        assert_eq!(pair.results.status, JobStatus::Quarantined);
        let failure = &pair.results.failure.as_ref().expect("a failure").failure;
        assert_eq!(failure.class, FailureClass::Resource);
        let wanted = "fit took longer than 5 s while it read ";
        assert!(failure.message.starts_with(wanted), "{}", failure.message);
        let name = Path::new(file).file_name().expect("a name");
        let name = name.to_string_lossy();
        assert!(failure.message.contains(&*name), "{}", failure.message);
    };
    std::thread::scope(|scope| {
        for (call_kind, file) in [("read", MESH), ("read", PRINT), ("open", MESH)] {
            scope.spawn(move || fails(call_kind, file));
        }
    });
}

#[test]
fn a_second_signal_does_not_wait_for_a_read_that_hangs() {
    let disk = HangingDisk::new("1");
    let command = run_with_progress(&disk.project, "json", &["-j", "1", "--json"]);
    let mut running = disk.start_hanging("read", MESH, command);
    running.send(Signal::TERM);
    running.send(Signal::INT);
    let (code, json, stderr) = running.end();
    assert_eq!((code, &json["stages"]), (Some(130), &0.into()), "{stderr}");
    let pair = &pairs(&disk.project)[0];
    assert_eq!((pair.results.status, pair.attempt), (JobStatus::Ready, 0));
}

/// When the read exceeds the stage time limit, the run hashes the file, so that a later run notices a replaced file.
#[test]
fn a_second_signal_does_not_wait_for_the_hash_after_a_read_that_hung() {
    let disk = HangingDisk::new("1");
    let args = ["-j", "1", "--set", "run.stage_timeout_s=3"];
    let command = run(&disk.project, &args);
    let mut running = disk.start_hanging("read", MESH, command);
    let notes = disk.dir.path().to_owned();
    running.wait_until("the file is hashed", || Fault::injected(&notes) >= 2);
    running.send(Signal::TERM);
    running.send(Signal::INT);
    let (code, _, stderr) = running.end();
    assert_eq!(code, Some(130), "{stderr}");
}

#[test]
fn a_file_that_hangs_before_the_first_stage_does_not_stop_a_run() {
    let disk = HangingDisk::new("2");
    call(&mut run(&disk.project, &[])).expect(0);
    let mut command = run(&disk.project, &["--set", "run.stage_timeout_s=1"]);
    let ended = call(disk.hang("stat", MESH, &mut command)).expect(0);
    let wanted = "upright-0000.ply did not answer within 1 s; it counts as unchanged";
    assert!(ended.err.contains(wanted), "{}", ended.err);
    assert!(ended.err.contains("nothing left to do"), "{}", ended.err);
    let mut running = disk.start_hanging("stat", MESH, run(&disk.project, &["--json"]));
    running.send(Signal::TERM);
    let (code, _, stderr) = running.end();
    assert_eq!(code, Some(0), "nothing was left to do: {stderr}");
}

/// These commands do not catch signals.
#[test]
fn a_file_that_hangs_does_not_keep_a_command_from_being_stopped() {
    let disk = HangingDisk::new("1");
    call(&mut run(&disk.project, &[])).expect(0);
    let manifest = disk.project.dir().join("data/manifest.csv");
    let manifest = manifest.to_str().expect("a path in UTF-8");
    let commands: [&[&str]; 4] = [
        &["run", "--dry-run"],
        &["check"],
        &["import", manifest],
        &["export", "-o", "exported"],
    ];
    for args in commands {
        let mut running = disk.start_hanging("stat", PRINT, disk.command(args));
        running.send(Signal::TERM);
        let (code, _, stderr) = running.end();
        assert_eq!(code, None, "{args:?}: {stderr}");
    }
}

#[test]
fn an_input_that_became_a_pipe_is_named_by_every_command() {
    let disk = HangingDisk::new("1");
    call(&mut run(&disk.project, &[])).expect(0);
    let print = disk.replace_by_pipe("data/prints/upright-0000.jpg");
    let tops = disk.replace_by_pipe("data/tops/upright-0000.png");
    let named = |path: &Path| format!("{} is a pipe, not a file", path.display());
    let commands: [(&[&str], i32); 7] = [
        (&["export", "-o", "exported"], 3),
        (&["report"], 3),
        (&["report", "--format", "html", "-o", "report.html"], 3),
        (&["contact-sheet", "-o", "sheet.png"], 3),
        (&["show", "upright-0000"], 0),
        (&["check"], 0),
        (&["run", "--rerun", "all"], 3),
    ];
    for (args, code) in commands {
        let ended = call(&mut disk.command(args)).expect(code);
        // A report wraps its lines.
        let said = format!("{}{}", ended.out, ended.err);
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let unusable = match args {
            ["export" | "run", ..] => &print,
            ["report"] => &tops,
            _ => continue,
        };
        assert!(said.contains(&named(unusable)), "{args:?}: {said}");
    }
}

#[test]
fn a_list_is_read_from_standard_input_and_not_from_a_device() {
    let disk = HangingDisk::new("1");
    let mut import = disk.command(&["import", "/dev/stdin", "--allow-missing"]);
    import.stdin(Stdio::piped()).stdout(Stdio::null());
    let mut child = import.spawn().expect("the binary starts");
    let list = "id,mesh,print\nanother,a.ply,a.png\n";
    let mut stdin = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut stdin, list.as_bytes()).expect("written");
    drop(stdin);
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    assert_eq!(pairs(&disk.project).len(), 2);
    for args in [
        &["import", "/dev/zero"][..],
        &["import", "p/data/manifest.csv", "--truth", "/dev/zero"],
        &["verdict", "import", "/dev/zero"],
        &["--config", "/dev/zero", "status"],
    ] {
        let refused = call(&mut disk.command(args)).expect(2);
        let wanted = "/dev/zero: it is a device, not a file";
        assert!(refused.err.contains(wanted), "{args:?}: {}", refused.err);
    }
}

#[test]
fn a_pipe_in_the_place_of_a_project_file_does_not_hang_a_command() {
    let disk = HangingDisk::new("1");
    let pipe = |path: PathBuf| {
        let _ = std::fs::remove_file(&path);
        let mode = Mode::RUSR | Mode::WUSR;
        mknodat(CWD, &path, FileType::Fifo, mode, 0).expect("a pipe");
    };
    pipe(disk.project.dir().join("run.members"));
    call(&mut disk.command(&["status"])).expect(0);
    pipe(disk.project.settings_path());
    for command in ["status", "run"] {
        let refused = call(&mut disk.command(&[command])).expect(2);
        assert!(refused.err.contains("it is a pipe"), "{}", refused.err);
    }
}

/// Settings are read by most commands before anything else.
#[test]
fn a_file_of_settings_that_became_a_device_is_refused() {
    let disk = HangingDisk::new("1");
    std::os::unix::fs::symlink("/dev/zero", disk.project.settings_path()).expect("a link");
    let refused = call(&mut disk.command(&["run"])).expect(2);
    assert!(refused.err.contains("it is a device"), "{}", refused.err);
}

/// The catalog is locked when all files of a list have been looked at, not before.
#[test]
fn an_import_that_waits_for_a_file_keeps_nobody_from_writing() {
    let disk = HangingDisk::new("3");
    let manifest = std::fs::read_to_string(disk.dir.path().join("p/data/manifest.csv"));
    let mut lines: Vec<String> = manifest
        .expect("a list")
        .lines()
        .map(str::to_owned)
        .collect();
    lines.truncate(3);
    let path = disk.dir.path().join("p/data/two.csv");
    std::fs::write(
        path,
        lines.join("\n").replace("upright-0000,", "again-0000,"),
    )
    .expect("a list");
    let hold = disk.dir.path().join("held");
    let mut import = binary();
    import
        .current_dir(disk.dir.path())
        .args(["-C", "p", "import", "p/data/two.csv"])
        .env("MOCBAN_HOLD_AT", "import:computed@upright-0001")
        .env("MOCBAN_HOLD_FILE", &hold);
    let mut import = Running::start(&mut import);
    import.wait_until("a file is looked at", || hold.exists());
    mocban(
        disk.dir.path(),
        &["-C", "p", "import", "p/data/manifest.csv"],
    )
    .expect(0);
    let retire = ["-C", "p", "retire", "upright-0002"];
    mocban(disk.dir.path(), &retire).expect(0);
    std::fs::remove_file(&hold).expect("released");
    let (code, _, err) = import.end();
    assert_eq!(code, Some(0), "{err}");
    let status = mocban(disk.dir.path(), &["-C", "p", "status", "--json"]).expect(0);
    assert_eq!(status.json()["pairs"], 3, "one was retired, one added");
}

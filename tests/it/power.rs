//! Power cuts while the binary runs. After each sync, the disk is rebuilt and checked, and the run on it is completed.
//!
//! Once a file is synced, its bytes are on the disk. Depending on the file system, the file's name is on the disk at
//! once or only after its folder is synced. Both cases are tested, and bytes and names may reach the disk in any order.

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use mocban::store::Project;

use crate::cli::{binary, call, mocban};
use crate::made_once::copy_folder;
use crate::resume::{attempts, copy, run, stages_done};
use crate::shim::SHADOW;
use crate::test_size::size_from_env;
use crate::uninterrupted::Comparison;

type Inode = u64;

/// An entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    inode: Inode,
    is_folder: bool,
}

type Folders = BTreeMap<Inode, BTreeMap<String, Entry>>;

/// The state of a disk: the names in each folder, and a copy of the bytes of each file.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Disk {
    root: Inode,
    folders: Folders,
    files: BTreeMap<Inode, PathBuf>,
}

/// A sync that succeeded.
#[derive(Debug)]
struct Sync {
    inode: Inode,
    /// The file's bytes; `None` for a folder.
    bytes: Option<PathBuf>,
    /// All names at that time.
    names: Folders,
}

/// When names reach the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Names {
    /// At the sync of their folder.
    Late,
    /// At once.
    Early,
}

impl Disk {
    /// Returns the state in which every file of a project is on the disk. `bytes` is an unchanging copy of the project.
    fn of(project: &Path, bytes: &Path) -> Self {
        let mut disk = Self {
            root: inode(project),
            folders: Folders::new(),
            files: BTreeMap::new(),
        };
        disk.add_folder(project, bytes);
        disk
    }

    fn add_folder(&mut self, folder: &Path, bytes: &Path) {
        let mut names = BTreeMap::new();
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let entry = entry.expect("an entry");
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_str().expect("UTF-8").to_owned();
            let (inode, is_folder) = (inode(&path), path.is_dir());
            if is_folder {
                self.add_folder(&path, &bytes.join(&name));
            } else {
                self.files.insert(inode, bytes.join(&name));
            }
            names.insert(name, Entry { inode, is_folder });
        }
        self.folders.insert(inode(folder), names);
    }

    /// Applies the names that reach the disk before the bytes of a sync.
    fn apply_names(&mut self, sync: &Sync, names: Names) {
        if names == Names::Early {
            self.folders.clone_from(&sync.names);
        }
    }

    /// Applies a sync.
    fn apply(&mut self, sync: &Sync, names: Names) {
        self.apply_names(sync, names);
        if let Some(bytes) = &sync.bytes {
            self.files.insert(sync.inode, bytes.clone());
        } else {
            let entries = sync.names.get(&sync.inode).cloned();
            self.folders.insert(sync.inode, entries.unwrap_or_default());
        }
    }

    /// Writes the disk's files to a folder.
    fn write(&self, to: &Path) {
        self.write_folder(self.root, to);
    }

    fn write_folder(&self, folder: Inode, to: &Path) {
        std::fs::create_dir_all(to).expect("a folder");
        for (name, entry) in self.folders.get(&folder).into_iter().flatten() {
            let to = to.join(name);
            if entry.is_folder {
                self.write_folder(entry.inode, &to);
            } else if let Some(bytes) = self.files.get(&entry.inode) {
                std::fs::copy(bytes, to).expect("copied");
            } else {
                std::fs::write(to, []).expect("an empty file");
            }
        }
    }
}

fn inode(path: &Path) -> Inode {
    std::fs::metadata(path).expect("a file").ino()
}

/// Parses names by folder from lines of `FOLDER INODE d|f NAME`.
fn names(text: &str) -> Folders {
    let mut folders = Folders::new();
    for line in text.lines() {
        let mut words = line.splitn(4, ' ');
        let mut word = || words.next().expect("four words");
        let folder = word().parse().expect("an inode");
        let inode = word().parse().expect("an inode");
        let is_folder = word() == "d";
        let entries: &mut BTreeMap<_, _> = folders.entry(folder).or_default();
        entries.insert(word().to_owned(), Entry { inode, is_folder });
    }
    folders
}

/// A command and the syncs that it made.
struct Recorded {
    start: Disk,
    syncs: Vec<Sync>,
}

impl Recorded {
    /// Runs a command and records its syncs below a folder. `notes` is a new folder for the records.
    fn of(root: &Path, notes: &Path, start: Disk, command: &mut Command) -> Self {
        std::fs::create_dir(notes).expect("a folder");
        command.env("SHADOW_OF", root).env("SHADOW_IN", notes);
        call(SHADOW.load(command)).expect(0);
        let log = std::fs::read_to_string(notes.join("log")).expect("syncs");
        let syncs = log.lines().map(|line| read_sync(notes, line)).collect();
        Self { start, syncs }
    }

    /// Returns the states of the disk in order of time, without repetitions.
    fn disks(&self, names: Names) -> Vec<Disk> {
        let mut disks = vec![self.start.clone()];
        let mut disk = self.start.clone();
        for sync in &self.syncs {
            disk.apply_names(sync, names);
            disks.push(disk.clone());
            disk.apply(sync, names);
            disks.push(disk.clone());
        }
        disks.dedup();
        disks
    }

    /// Returns the last state of the disk.
    fn end(&self, names: Names) -> Disk {
        self.disks(names).pop().expect("at least the first state")
    }
}

fn read_sync(notes: &Path, line: &str) -> Sync {
    let mut words = line.split(' ');
    let mut word = || words.next().expect("three words");
    let (number, kind, inode) = (word(), word(), word());
    let text = std::fs::read_to_string(notes.join(format!("{number}.names"))).expect("names");
    Sync {
        inode: inode.parse().expect("an inode"),
        bytes: (kind == "file").then(|| notes.join(format!("{number}.file"))),
        names: names(&text),
    }
}

impl Comparison {
    /// Runs a copy of the project and records its syncs.
    fn record_run(&self, args: &[&str]) -> Recorded {
        let root = self.folder("recorded");
        let project = copy(&self.fresh, &root.join("p"));
        let start = Disk::of(project.dir(), self.fresh.dir());
        let mut command = run(&project, args);
        Recorded::of(project.dir(), &root.join("notes"), start, &mut command)
    }

    /// Copies a simulated disk to a project directory, checks the project, completes its run and compares the results.
    fn assert_recovers(&self, disk: &Disk, name: &str) {
        let parent = self.dir.path().join(name);
        let path = parent.join("p");
        disk.write(&path);
        // Every row's files exist, and nothing else is damaged either.
        let checked = mocban(&parent, &["-C", "p", "check"]);
        assert_eq!(checked.code, 0, "{name}: {}{}", checked.out, checked.err);
        let project = Project::open(&path).expect("a project");
        let ended = call(&mut run(&project, &["-j", "1"]));
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
        mocban(&parent, &["-C", "p", "check"]).expect(0);
        self.expected.assert_met_by(&project);
        std::fs::remove_dir_all(parent).expect("removed");
    }

    /// Calls `assert_recovers` for each disk, on all cores.
    fn assert_all_recover(&self, disks: &[(String, Disk)]) {
        let next = AtomicUsize::new(0);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..cores {
                scope.spawn(|| {
                    while let Some((name, disk)) = disks.get(next.fetch_add(1, Ordering::Relaxed)) {
                        self.assert_recovers(disk, name);
                    }
                });
            }
        });
    }
}

/// Returns the states of the disk in both cases, each with a name.
fn all(recorded: &Recorded) -> Vec<(String, Disk)> {
    let named = |names| {
        let disks = recorded.disks(names).into_iter().enumerate();
        disks.map(move |(index, disk)| (format!("{names:?}-{index}"), disk))
    };
    named(Names::Late).chain(named(Names::Early)).collect()
}

/// Returns about `wanted` evenly spaced disks. Changes of names and bytes alternate, so an odd step picks both.
fn some(disks: Vec<(String, Disk)>, wanted: usize) -> Vec<(String, Disk)> {
    let step = disks.len().div_ceil(wanted) | 1;
    disks.into_iter().step_by(step).collect()
}

#[test]
fn a_power_cut_after_any_sync_loses_nothing_that_was_stored() {
    let cuts = size_from_env("MOCBAN_POWER_CUTS", 36);
    let comparison = Comparison::new("2");
    let recorded = comparison.record_run(&["-j", "2"]);
    let disks = all(&recorded);
    let (syncs, found) = (recorded.syncs.len(), disks.len());
    let chosen = some(disks, cuts);
    assert!(chosen.len() > 1, "nothing was synced");
    comparison.assert_all_recover(&chosen);
    eprintln!(
        "{syncs} syncs, {found} states of the disk, {} of them run to the end",
        chosen.len()
    );
}

#[test]
fn all_stages_reach_the_disk_in_their_order() {
    let comparison = Comparison::new("1");
    let recorded = comparison.record_run(&["-j", "1"]);
    let disks = recorded.disks(Names::Late).into_iter().enumerate();
    let done = disks.map(|(index, disk)| {
        let folder = comparison.folder(&format!("done-{index}"));
        disk.write(&folder);
        stages_done(&Project::open(&folder).expect("a project"))
    });
    let mut done: Vec<_> = done.collect();
    done.dedup();
    // Short stages may be stored together.
    assert!(done.is_sorted(), "{done:?}");
    assert_eq!(
        (done.first(), done.last()),
        (Some(&0), Some(&4)),
        "{done:?}"
    );
}

/// A process creates artifact folders and dies before their names are on the disk. The next process finds the folders.
#[test]
fn a_folder_that_another_process_created_is_synced_before_a_row_is() {
    let comparison = Comparison::new("1");
    let root = comparison.folder("found");
    let project = copy(&comparison.fresh, &root.join("p"));
    let start = Disk::of(project.dir(), comparison.fresh.dir());
    // The folders of a dead process, none of them on the disk.
    for folder in comparison
        .expected
        .project()
        .artifacts_dir()
        .read_dir()
        .expect("a folder")
    {
        let folder = folder.expect("an entry");
        if folder.file_type().expect("a type").is_dir() {
            let name = folder.file_name();
            std::fs::create_dir_all(project.artifacts_dir().join(name)).expect("a folder");
        }
    }
    let mut command = run(&project, &["-j", "1"]);
    let recorded = Recorded::of(project.dir(), &root.join("notes"), start, &mut command);
    let disks: Vec<_> = all(&recorded);
    comparison.assert_all_recover(&some(disks, 6));
    comparison.assert_recovers(&recorded.end(Names::Late), "end");
}

#[test]
fn an_import_is_durable_when_it_ends_and_can_be_repeated_before() {
    let comparison = Comparison::new("1");
    let root = comparison.folder("imported");
    let data = comparison.fresh.dir().join("data");
    copy_folder(&data, &root.join("data"));
    let start = Disk::of(&root, comparison.fresh.dir());
    let mut command = import(&root);
    let notes = comparison.dir.path().join("notes");
    let recorded = Recorded::of(&root, &notes, start, &mut command);
    for names in [Names::Late, Names::Early] {
        let disks = recorded.disks(names);
        for disk in disks.iter().step_by(5) {
            let root = comparison.folder("cut");
            disk.write(&root);
            call(&mut import(&root)).expect(0);
            assert_completes(&root);
        }
        let root = comparison.folder("cut");
        recorded.end(names).write(&root);
        assert_completes(&root);
    }
}

/// Returns the command that imports the folder `data` into a new project `p`. Both are below `root`.
fn import(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("import");
    command.arg(root.join("data/manifest.csv"));
    command
}

/// Checks the project `p` in a folder and runs it.
fn assert_completes(root: &Path) {
    mocban(root, &["-C", "p", "check"]).expect(0);
    let project = Project::open(&root.join("p")).expect("a project");
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(attempts(&project), [1; 4]);
}

//! Power cuts under the real binary: what the disk would hold after each sync is put together, opened, checked, and
//! run to the end.
//!
//! A file's bytes are on the disk when they were synced. When its name is there too is answered in two ways, because
//! file systems differ: at the sync of its folder and not before, or at once. Both must do, with bytes and names in
//! whatever order.

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use mocban::store::Project;

use crate::cli::{binary, call, mocban};
use crate::resume::{copy, copy_folder, finished, run, stages_done};
use crate::shim::SHADOW;
use crate::test_size::size_from_env;
use crate::unbroken::World;

type Inode = u64;

/// An entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    inode: Inode,
    is_folder: bool,
}

type Folders = BTreeMap<Inode, BTreeMap<String, Entry>>;

/// What a disk holds: names by folder, and by file where its bytes lie for us.
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
    /// All names that there were.
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
    /// A project as it lies there, all of it on the disk; `bytes` is a copy of it that stays as it is.
    fn of(project: &Path, bytes: &Path) -> Self {
        let mut disk = Self {
            root: inode(project),
            folders: Folders::new(),
            files: BTreeMap::new(),
        };
        disk.take_in(project, bytes);
        disk
    }

    fn take_in(&mut self, folder: &Path, bytes: &Path) {
        let mut names = BTreeMap::new();
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let entry = entry.expect("an entry");
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_str().expect("UTF-8").to_owned();
            let (inode, is_folder) = (inode(&path), path.is_dir());
            if is_folder {
                self.take_in(&path, &bytes.join(&name));
            } else {
                self.files.insert(inode, bytes.join(&name));
            }
            names.insert(name, Entry { inode, is_folder });
        }
        self.folders.insert(inode(folder), names);
    }

    /// What names are there before the bytes of a sync are.
    fn name(&mut self, sync: &Sync, names: Names) {
        if names == Names::Early {
            self.folders.clone_from(&sync.names);
        }
    }

    fn sync(&mut self, sync: &Sync, names: Names) {
        self.name(sync, names);
        if let Some(bytes) = &sync.bytes {
            self.files.insert(sync.inode, bytes.clone());
        } else {
            let there = sync.names.get(&sync.inode).cloned();
            self.folders.insert(sync.inode, there.unwrap_or_default());
        }
    }

    /// Puts the files where a program can open them.
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
    std::fs::metadata(path).expect("it is there").ino()
}

/// Names by folder, from lines of `FOLDER INODE d|f NAME`.
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

/// A run whose syncs were written down.
struct Recorded {
    start: Disk,
    syncs: Vec<Sync>,
}

impl Recorded {
    /// Calls a command and writes down the syncs below a folder; `notes` is a folder that is not there yet.
    fn of(root: &Path, notes: &Path, start: Disk, command: &mut Command) -> Self {
        std::fs::create_dir(notes).expect("a folder");
        command.env("SHADOW_OF", root).env("SHADOW_IN", notes);
        call(SHADOW.load(command)).expect(0);
        let log = std::fs::read_to_string(notes.join("log")).expect("syncs");
        let syncs = log.lines().map(|line| read_sync(notes, line)).collect();
        Self { start, syncs }
    }

    /// What the disk may hold at one moment or another; each but the first differs from the one before it.
    fn disks(&self, names: Names) -> Vec<Disk> {
        let mut disks = vec![self.start.clone()];
        let mut disk = self.start.clone();
        for sync in &self.syncs {
            disk.name(sync, names);
            disks.push(disk.clone());
            disk.sync(sync, names);
            disks.push(disk.clone());
        }
        disks.dedup();
        disks
    }

    /// What is on the disk at the end.
    fn end(&self, names: Names) -> Disk {
        self.disks(names).pop().expect("the start at least")
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

impl World {
    /// A run of the project from its beginning.
    fn recorded(&self, args: &[&str]) -> Recorded {
        let root = self.folder("recorded");
        let project = copy(&self.fresh, &root.join("p"));
        let start = Disk::of(project.dir(), self.fresh.dir());
        let mut command = run(&project, args);
        Recorded::of(project.dir(), &root.join("notes"), start, &mut command)
    }

    /// Opens a disk, checks it, and runs it to the end.
    fn is_met_by(&self, disk: &Disk, name: &str) {
        let parent = self.dir.path().join(name);
        let broken = parent.join("p");
        disk.write(&broken);
        // No row names a file that is not there, and nothing else is wrong either.
        let checked = mocban(&parent, &["-C", "p", "check"]);
        assert_eq!(checked.code, 0, "{name}: {}{}", checked.out, checked.err);
        let project = Project::open(&broken).expect("a project");
        let ended = call(&mut run(&project, &["-j", "1"]));
        assert_eq!(ended.code, 0, "{name}: {}", ended.err);
        mocban(&parent, &["-C", "p", "check"]).expect(0);
        self.wanted.is_met_by(&project);
        std::fs::remove_dir_all(parent).expect("removed");
    }

    /// Does that with many, on all cores.
    fn is_met_by_all(&self, disks: &[(String, Disk)]) {
        let next = AtomicUsize::new(0);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        std::thread::scope(|scope| {
            for _ in 0..cores {
                scope.spawn(|| {
                    while let Some((name, disk)) = disks.get(next.fetch_add(1, Ordering::Relaxed)) {
                        self.is_met_by(disk, name);
                    }
                });
            }
        });
    }
}

/// Both answers' disks, each with a name.
fn all(recorded: &Recorded) -> Vec<(String, Disk)> {
    let named = |names| {
        let disks = recorded.disks(names).into_iter().enumerate();
        disks.map(move |(index, disk)| (format!("{names:?}-{index}"), disk))
    };
    named(Names::Late).chain(named(Names::Early)).collect()
}

/// About so many of them, evenly; an odd step, because names and bytes take turns.
fn some(disks: Vec<(String, Disk)>, wanted: usize) -> Vec<(String, Disk)> {
    let step = disks.len().div_ceil(wanted) | 1;
    disks.into_iter().step_by(step).collect()
}

/// Cuts the power during a run at some moments.
#[test]
fn a_power_cut_at_some_syncs_loses_nothing_that_was_stored() {
    let moments = size_from_env("MOCBAN_POWER_CUTS", 36);
    let world = World::new("2");
    let recorded = world.recorded(&["-j", "2"]);
    let disks = all(&recorded);
    let (syncs, found) = (recorded.syncs.len(), disks.len());
    let chosen = some(disks, moments);
    assert!(chosen.len() > 1, "nothing was synced");
    world.is_met_by_all(&chosen);
    eprintln!(
        "{syncs} syncs, {found} disks, {} opened and run to the end",
        chosen.len()
    );
}

#[test]
fn stages_come_to_the_disk_in_their_order_and_all_of_them() {
    let world = World::new("1");
    let recorded = world.recorded(&["-j", "1"]);
    let disks = recorded.disks(Names::Late).into_iter().enumerate();
    let done = disks.map(|(index, disk)| {
        let broken = world.folder(&format!("done-{index}"));
        disk.write(&broken);
        stages_done(&Project::open(&broken).expect("a project"))
    });
    let mut done: Vec<_> = done.collect();
    done.dedup();
    // Short stages may come together.
    assert!(done.is_sorted(), "{done:?}");
    assert_eq!(
        (done.first(), done.last()),
        (Some(&0), Some(&4)),
        "{done:?}"
    );
}

/// A process makes a folder of artifacts and dies before its name is on the disk; another finds it there.
#[test]
fn a_folder_that_another_process_made_is_on_the_disk_before_a_row_is() {
    let world = World::new("1");
    let root = world.folder("found");
    let project = copy(&world.fresh, &root.join("p"));
    let start = Disk::of(project.dir(), world.fresh.dir());
    // What a dead process left, none of it on the disk.
    for folder in world
        .wanted
        .project()
        .artifacts_dir()
        .read_dir()
        .expect("a folder")
    {
        let name = folder.expect("an entry").file_name();
        std::fs::create_dir_all(project.artifacts_dir().join(name)).expect("a folder");
    }
    let mut command = run(&project, &["-j", "1"]);
    let recorded = Recorded::of(project.dir(), &root.join("notes"), start, &mut command);
    let disks: Vec<_> = all(&recorded);
    world.is_met_by_all(&some(disks, 6));
    world.is_met_by(&recorded.end(Names::Late), "end");
}

#[test]
fn an_import_is_on_the_disk_when_it_says_so_and_can_be_made_again_before() {
    let world = World::new("1");
    let root = world.folder("imported");
    let data = world.fresh.dir().join("data");
    copy_folder(&data, &root.join("data"));
    let start = Disk::of(&root, world.fresh.dir());
    let mut command = import(&root);
    let notes = world.dir.path().join("notes");
    let recorded = Recorded::of(&root, &notes, start, &mut command);
    for names in [Names::Late, Names::Early] {
        let disks = recorded.disks(names);
        for disk in disks.iter().step_by(5) {
            let root = world.folder("cut");
            disk.write(&root);
            call(&mut import(&root)).expect(0);
            is_run_to_the_end(&root);
        }
        let root = world.folder("cut");
        recorded.end(names).write(&root);
        is_run_to_the_end(&root);
    }
}

/// Imports the data beside a project that is not there.
fn import(root: &Path) -> Command {
    let mut command = binary();
    command.arg("-C").arg(root.join("p")).arg("import");
    command.arg(root.join("data/manifest.csv"));
    command
}

fn is_run_to_the_end(root: &Path) {
    mocban(root, &["-C", "p", "check"]).expect(0);
    let project = Project::open(&root.join("p")).expect("a project");
    call(&mut run(&project, &[])).expect(0);
    assert_eq!(finished(&project), [1; 4]);
}

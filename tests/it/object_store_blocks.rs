//! Whole blocks in a project whose artifacts are in an object store: the results are those of local files, and another
//! computer can go on with them.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::cli::{Call, binary, call, empty, mocban};
use crate::s3_server::S3Server;
use crate::small_block::{CHARACTERS, demo_block, few_labels};
use crate::uninterrupted::assert_same_files;

/// A project with a block below a local folder that has been run, and one with the same block in an object store.
struct RemoteBlock {
    dir: tempfile::TempDir,
    server: S3Server,
}

impl RemoteBlock {
    /// Returns `None` if no server is installed.
    fn new() -> Option<Self> {
        let server = S3Server::start()?;
        let dir = empty();
        demo_block(dir.path());
        let data = dir.path().join("d/data");
        few_labels(dir.path(), &data.join("few.json"));
        server.upload(&data, "scans");
        let list = "block,mesh,page,labels\nb1,scans:block.ply,scans:page.jpg,scans:few.json\n";
        fs::write(dir.path().join("blocks.csv"), list).expect("written");
        let local = format!("storage.roots.scans = '{}'\n", data.display());
        let remote = "[storage]\nartifacts = \"s3://mocban/results\"\n[storage.roots]\nscans = \"s3://mocban/scans\"\n";
        for (project, settings) in [("local", &*local), ("remote", remote)] {
            let folder = dir.path().join(project);
            fs::create_dir(&folder).expect("a folder");
            fs::write(folder.join("mocban.toml"), settings).expect("written");
        }
        let made = Self { dir, server };
        for args in [&["import", "blocks.csv"][..], &["run"]] {
            mocban(made.path(), &[&["-C", "local"], args].concat()).expect(0);
        }
        made.remote(&["import", "blocks.csv"]).expect(0);
        Some(made)
    }

    fn path(&self) -> &Path {
        self.dir.path()
    }

    /// Returns a command on a project in the store, with the local copies of one computer.
    fn command(&self, project: &str, cache: &str, args: &[&str]) -> Command {
        let mut command = binary();
        command.current_dir(self.path());
        command.env("XDG_CACHE_HOME", self.path().join(cache));
        S3Server::configure(&mut command, self.server.port());
        command.args(["-C", project]).args(args);
        command
    }

    fn remote(&self, args: &[&str]) -> Call {
        call(&mut self.command("remote", "cache", args))
    }

    /// Checks that the export equals that of the local project, and that nothing is damaged.
    #[track_caller]
    fn assert_same_results(&self) {
        for folder in ["of-local", "of-remote"] {
            let _ = fs::remove_dir_all(self.path().join(folder));
        }
        let export = ["export", "--to", "jsonl", "-o"];
        let local = [&["-C", "local"], &export[..], &["of-local"]].concat();
        mocban(self.path(), &local).expect(0);
        self.remote(&[&export[..], &["of-remote"]].concat())
            .expect(0);
        let [local, remote] = ["of-local", "of-remote"].map(|name| self.path().join(name));
        assert!(assert_same_files(&local, &remote) > CHARACTERS);
        self.remote(&["check"]).expect(0);
    }

    /// Returns the keys of the meshes and prints of characters.
    fn cut_files(&self) -> Vec<String> {
        self.server.list("results/artifacts")
    }
}

#[test]
fn a_block_in_an_object_store_gives_the_results_of_local_files() {
    let Some(block) = RemoteBlock::new() else {
        return;
    };
    // The first computer dies when the characters are cut, and another one aligns them.
    let mut killed = block.command("remote", "cache", &["run"]);
    killed
        .env("MOCBAN_BREAK_AT", "cut:committed")
        .stderr(Stdio::null());
    let ended = killed.status().expect("it ends");
    assert!(!ended.success(), "the failpoint was not reached");
    assert!(!block.path().join("remote/artifacts").exists());
    assert_eq!(block.cut_files().len(), 2 * CHARACTERS);
    let run = call(&mut block.command("remote", "other", &["run", "--json"]))
        .expect(0)
        .json();
    assert_eq!(
        (&run["done"], &run["blocks"]["done"]),
        (&CHARACTERS.into(), &0.into())
    );
    block.assert_same_results();
    // One pack of the block's heights, and at least one of each pair: a busy machine stores the stages of a pair in several.
    assert!(block.server.list("results/packs").len() > CHARACTERS);
    let again = block.remote(&["run", "--json"]).expect(0).json();
    assert_eq!((&again["done"], &again["stages"]), (&0.into(), &0.into()));
    // The same characters are cut again, under the same names.
    let run = block
        .remote(&["run", "b1", "--rerun", "all", "--json"])
        .expect(0)
        .json();
    assert_eq!(run["blocks"]["done"], 1);
    assert_eq!(block.cut_files().len(), 2 * CHARACTERS);
    block.remote(&["check", "--collect=1"]).expect(0);
    block.assert_same_results();
}

#[test]
fn a_lost_file_of_a_block_in_an_object_store_is_written_again() {
    let Some(block) = RemoteBlock::new() else {
        return;
    };
    block.remote(&["run"]).expect(0);
    let lost = block.cut_files().swap_remove(0);
    block.server.remove(&lost);
    let checked = block.remote(&["check"]).expect(12);
    assert!(
        checked.out.contains(&lost["results/".len()..]),
        "{}",
        checked.out
    );
    let quick = block.remote(&["check", "--quick"]).expect(12);
    assert!(
        quick.out.contains(&lost["results/".len()..]),
        "{}",
        quick.out
    );
    block.remote(&["check", "--repair"]).expect(0);
    block.remote(&["run"]).expect(0);
    block.assert_same_results();
    // A backup has the catalog; the files stay in the store.
    block.remote(&["backup", "copy.sqlite"]).expect(0);
    mocban(block.path(), &["restore", "copy.sqlite", "restored"]).expect(0);
    let settings = block.path().join("remote/mocban.toml");
    fs::copy(settings, block.path().join("restored/mocban.toml")).expect("copied");
    call(&mut block.command("restored", "third", &["check"])).expect(0);
    call(&mut block.command("restored", "third", &["show", "b1"])).expect(0);
}

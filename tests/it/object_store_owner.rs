//! An object store that belongs to another catalog, that cannot be read, or whose settings are wrong: nothing in it or in
//! the catalog changes.

use std::process::Command;

use crate::cli::{call, mocban};
use crate::made_once::copy_folder;
use crate::object_store::Remote;
use crate::own_port::own_port;

/// A backup restored beside the original, and a copied folder, name the same bucket.
#[test]
fn a_bucket_belongs_to_one_catalog_until_another_takes_it_over() {
    let Some(remote) = Remote::new() else { return };
    let port = remote.server.port();
    remote.remote(port, &["run"]).expect(0);
    remote.remote(port, &["backup", "b.sqlite"]).expect(0);
    mocban(remote.path(), &["restore", "b.sqlite", "again"]).expect(0);
    let settings = |folder: &str| remote.path().join(folder).join("mocban.toml");
    std::fs::copy(settings("remote"), settings("again")).expect("copied");
    copy_folder(&remote.path().join("remote"), &remote.path().join("copy"));
    let objects = remote.server.list("results");
    let of = |folder: &str, args: &[&str]| {
        let mut command = remote.command_of(folder, port, "cache");
        call(command.args(args))
    };
    for (folder, kind) in [
        ("again", "of another catalog"),
        ("copy", "the original or a copy"),
    ] {
        for args in [
            &["check", "--repair"][..],
            &["check", "--collect=1"],
            &["run", "--rerun", "all"],
            &["plan"],
        ] {
            let refused = of(folder, args).expect(2);
            for wanted in [
                "s3://mocban/results",
                kind,
                "remote/catalog.sqlite",
                "--take-over",
            ] {
                assert!(refused.err.contains(wanted), "{wanted}: {}", refused.err);
            }
        }
        assert!(of(folder, &["check"]).expect(0).err.contains("warning: "));
    }
    assert_eq!(remote.server.list("results"), objects);
    // The project is moved, without a word, and another catalog takes the place over.
    std::fs::rename(remote.path().join("remote"), remote.path().join("moved")).expect("moved");
    let told = of("moved", &["check", "--repair"]).expect(0);
    assert!(!told.err.contains("warning"), "{}", told.err);
    let told = of("again", &["check", "--take-over"]).expect(0);
    assert!(
        told.err.contains("now belongs to this catalog"),
        "{}",
        told.err
    );
    of("again", &["check", "--repair"]).expect(0);
    let refused = of("moved", &["run"]).expect(2);
    assert!(
        refused.err.contains("again/catalog.sqlite"),
        "{}",
        refused.err
    );
    of("again", &["run"]).expect(0);
}

/// Wrong settings look as if every result were gone.
#[test]
fn a_repair_with_a_store_that_cannot_be_read_changes_nothing() {
    let Some(remote) = Remote::new() else { return };
    let port = remote.server.port();
    remote.remote(port, &["run"]).expect(0);
    let before = remote.remote(port, &["status", "--json"]).expect(0).out;
    let set = |setting: &str, args: &[&str]| {
        let all = [&["--set", setting][..], args].concat();
        call(&mut remote.command(port, "cache", &all))
    };
    for args in [
        &["check"][..],
        &["check", "--repair"],
        &["check", "--repair", "--accept-missing"],
    ] {
        let refused = set("storage.artifacts=s3://no-such-bucket/x", args).expect(1);
        let reason = "there is no such bucket";
        assert_eq!(refused.err.matches(reason).count(), 1, "{}", refused.err);
        assert!(refused.out.is_empty(), "{}", refused.out);
    }
    // Another folder has no results.
    let kept = set(
        "storage.artifacts=s3://mocban/other",
        &["check", "--repair"],
    )
    .expect(12);
    assert!(kept.out.contains("no result file is there"), "{}", kept.out);
    let away = call(
        remote
            .command(1, "cache", &["check", "--repair"])
            .env("MOCBAN_STORE_TIME_SCALE", "240"),
    )
    .expect(1);
    assert!(
        away.err.contains("does not answer properly"),
        "{}",
        away.err
    );
    assert_eq!(
        remote.remote(port, &["status", "--json"]).expect(0).out,
        before
    );
    remote.assert_same_results();
}

#[test]
fn settings_of_the_store_that_are_wrong_are_explained() {
    let Some(remote) = Remote::new() else { return };
    let port = remote.server.port();
    let refused = |command: &mut Command, code: i32, wanted: &str| {
        let refused = call(command).expect(code);
        assert!(refused.err.contains(wanted), "{}", refused.err);
        assert!(
            !refused.err.contains("secret-of-the-test"),
            "{}",
            refused.err
        );
        assert_eq!(refused.err.lines().count(), 1, "{}", refused.err);
    };
    let set = |setting: &str| remote.command(port, "cache", &["--set", setting, "run"]);
    let missing = &mut set("storage.artifacts=s3://no-such-bucket/x");
    refused(missing, 2, "s3://no-such-bucket/x: there is no such bucket");
    refused(
        &mut set("storage.artifacts=https://x"),
        2,
        "begins with s3://",
    );
    refused(
        &mut set("storage.roots.scans=data"),
        2,
        "give an absolute path",
    );
    refused(
        &mut set("storage.roots.Scans=/data"),
        2,
        "storage.roots.Scans: ",
    );
    let mut status = remote.command(port, "cache", &["status"]);
    call(status.env_remove("AWS_ACCESS_KEY_ID")).expect(0);
    let without_keys = &mut remote.command(port, "cache", &["run"]);
    refused(
        without_keys.env_remove("AWS_ACCESS_KEY_ID"),
        2,
        "no keys: set AWS_ACCESS_KEY_ID",
    );
    // Nobody listens at this port.
    let away = &mut remote.command(own_port(), "cache", &["run"]);
    refused(away, 1, "the object store does not answer properly");
    let list = "id,mesh,print\nnew,scans:meshes/none.obj,scans:prints/none.png\n";
    std::fs::write(remote.path().join("more.csv"), list).expect("written");
    let import = remote.remote(port, &["import", "more.csv"]).expect(2);
    assert!(import.err.contains("2 files are missing"), "{}", import.err);
    remote.remote(port, &["run"]).expect(0);
    // Without the setting, nobody knows where the packs are.
    std::fs::write(remote.path().join("remote/mocban.toml"), "").expect("written");
    let without_store = ["--set", "storage.roots.scans=s3://mocban/scans"];
    let export = ["export", "--to", "jsonl", "-o", "lost"];
    let export = remote.remote(port, &[&without_store[..], &export].concat());
    assert_ne!(export.code, 0);
    assert!(
        export.err.contains("set storage.artifacts"),
        "{}",
        export.err
    );
}

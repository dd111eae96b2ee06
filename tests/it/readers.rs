//! Hostile bytes to every reader: an answer or a sentence, never a panic, and no mesh or picture that breaks a promise.

use std::path::Path;

use mocban::config::{BaseLayer, Sources, load};
use mocban::manifest::{parse_csv, parse_jsonl};
use mocban::{mesh, raster};

use crate::corruption::Corruptor;
use crate::sample_files::{self, NamedFile, assert_one_sentence};
use crate::test_size::size_from_env;

const MESH: mesh::MeshLimits = mesh::MeshLimits {
    max_bytes: 1 << 20,
    max_vertices: 5000,
    max_triangles: 5000,
};

const IMAGE: raster::ImageLimits = raster::ImageLimits {
    max_bytes: 1 << 20,
    max_pixels: 1 << 16,
};

fn read_mesh(name: &str, bytes: &[u8]) -> Result<(), String> {
    let mesh = mesh::read(bytes, name, &MESH).map_err(|error| error.to_string())?;
    assert!(mesh.vertices.iter().flatten().all(f64::is_finite), "{name}");
    assert!(mesh.triangles.len() as u64 <= MESH.max_triangles, "{name}");
    let count = mesh.vertices.len() as u32;
    assert!(
        mesh.triangles
            .as_flattened()
            .iter()
            .all(|index| *index < count),
        "{name}"
    );
    Ok(())
}

fn read_image(_: &str, bytes: &[u8]) -> Result<(), String> {
    let picture = raster::decode(bytes, &IMAGE).map_err(|error| error.to_string())?;
    assert!(picture.rgb.data().len() as u64 <= IMAGE.max_pixels);
    Ok(())
}

fn read_list(name: &str, bytes: &[u8]) -> Result<(), String> {
    let read = if name.ends_with("jsonl") {
        parse_jsonl(bytes)
    } else {
        parse_csv(bytes)
    };
    read.map(drop).map_err(|refused| {
        for problem in &refused.problems {
            assert_one_sentence(problem);
        }
        refused.problems.first().cloned().expect("a problem")
    })
}

/// As a file where it is TOML, and line by line as flags.
fn read_settings(name: &str, bytes: &[u8]) -> Result<(), String> {
    let dir = crate::cli::empty();
    let file = dir.path().join("mocban.toml");
    std::fs::write(&file, bytes).expect("written");
    let sets = String::from_utf8_lossy(bytes);
    let sources = if Path::new(name).extension().is_some_and(|end| end == "toml") {
        Sources {
            base: BaseLayer::File(file),
            ..Sources::default()
        }
    } else {
        Sources {
            sets: sets.lines().map(str::to_owned).collect(),
            ..Sources::default()
        }
    };
    load(&sources).map(drop).map_err(|error| error.to_string())
}

type Reader = fn(&str, &[u8]) -> Result<(), String>;

fn readers() -> [(&'static str, Vec<NamedFile>, Reader); 4] {
    [
        ("mesh", sample_files::meshes(), read_mesh),
        ("image", sample_files::images(), read_image),
        ("list", sample_files::lists(), read_list),
        ("settings", sample_files::settings(), read_settings),
    ]
}

/// Signed samples may mean anything; all other whole files are read.
const REFUSED: [&str; 1] = ["grey_signed16.tif"];

#[test]
fn every_whole_file_is_read() {
    for (kind, files, read) in readers() {
        for (name, bytes) in files {
            let outcome = read(&name, &bytes);
            assert_eq!(
                outcome.is_err(),
                REFUSED.contains(&&*name),
                "{kind}: {name}: {outcome:?}"
            );
        }
    }
}

#[test]
fn spoilt_files_of_every_kind_are_read_or_told_in_a_sentence() {
    let each = size_from_env("MOCBAN_SPOILT", 120);
    for (kind, files, read) in readers() {
        let mut corruptor = Corruptor::new(2026);
        let mut refused = 0;
        for (name, whole) in &files {
            for _ in 0..each {
                if let Err(sentence) = read(name, &corruptor.corrupt(whole)) {
                    assert_one_sentence(&sentence);
                    refused += 1;
                }
            }
        }
        let all = files.len() * each;
        assert!(
            (all / 5..all).contains(&refused),
            "{kind}: {refused} of {all}"
        );
    }
}

/// Lays the whole files out for the fuzzer where it is told to.
#[test]
fn the_fuzzer_starts_from_whole_files() {
    let dir = std::env::var_os("MOCBAN_CORPUS").map(std::path::PathBuf::from);
    let meshes = sample_files::meshes()
        .into_iter()
        .map(|(name, bytes)| (name, [b"\0", &bytes[..]].concat()));
    let mut all = vec![
        ("pair", meshes.collect()),
        ("verdicts", sample_files::verdicts()),
    ];
    all.extend(readers().map(|(kind, files, _)| (kind, files)));
    for (kind, files) in all {
        assert!(!files.is_empty(), "{kind}");
        let Some(dir) = &dir else { continue };
        std::fs::create_dir_all(dir.join(kind)).expect("a folder");
        for (name, bytes) in files {
            std::fs::write(dir.join(kind).join(name), bytes).expect("written");
        }
    }
}

/// What the fuzzer found: words of a file went to the screen as they were, commands to the terminal among them.
#[test]
fn words_with_commands_to_a_screen_come_out_as_escapes() {
    for (read, name, bytes) in [
        (
            read_mesh as Reader,
            "a.ply",
            &b"ply\nformat ascii 1.0\nelement \x1b[2J 9\nproperty char a\nend_header\n1\n"[..],
        ),
        (read_mesh, "a.ply", b"ply\nformat \x07\n"),
        (read_mesh, "a.stl", b"solid a\n\x1b]0;owned\x07 b\n"),
        (read_mesh, "a.obj", b"v 0 \x1b[31m 0\n"),
        (read_list, "a.csv", b"id,mesh,pr\x00int\na,b,c\n"),
        (
            read_list,
            "a.csv",
            "id,mesh,print\n\u{202e}\x1b[2J,b,c\n".as_bytes(),
        ),
        (read_list, "a.jsonl", b"{\"id\":[\"\\u001b[2J\"]}\n"),
        (read_settings, "a.toml", b"\"r\\u001bun\" = 1\n"),
        (
            read_settings,
            "a.toml",
            b"[run]\nworkers = \"\\u001b[2J\"\n",
        ),
        (read_settings, "a.txt", b"run.work\x1bers=1\n"),
    ] {
        let sentence = read(name, bytes).expect_err(name);
        assert_one_sentence(&sentence);
    }
}

//! Every parser on valid and on corrupted files. A parser may give an error in one sentence, but never panics and never
//! returns an invalid mesh or image.

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
    assert!((picture.rgb.width() * picture.rgb.height()) as u64 <= IMAGE.max_pixels);
    Ok(())
}

fn read_list(name: &str, bytes: &[u8]) -> Result<(), String> {
    let read = if name.ends_with("jsonl") {
        parse_jsonl(bytes)
    } else {
        parse_csv(bytes)
    };
    read.map(drop).map_err(|refused| {
        let text = refused.to_string();
        for problem in text.lines() {
            assert_one_sentence(problem);
        }
        text.lines().next().expect("a problem").to_owned()
    })
}

/// Loads a TOML file as settings, or any other text line by line as `--set` flags.
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

type Parser = fn(&str, &[u8]) -> Result<(), String>;

fn parsers() -> [(&'static str, Vec<NamedFile>, Parser); 4] {
    [
        ("mesh", sample_files::meshes(), read_mesh),
        ("image", sample_files::images(), read_image),
        ("list", sample_files::lists(), read_list),
        ("settings", sample_files::settings(), read_settings),
    ]
}

/// Valid files that are refused, because no range is defined for signed samples.
const REFUSED: [&str; 1] = ["grey_signed16.tif"];

#[test]
fn every_valid_file_is_parsed() {
    for (kind, files, read) in parsers() {
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
fn corrupted_files_are_parsed_or_rejected_in_one_sentence() {
    let each = size_from_env("MOCBAN_SPOILT", 120);
    for (kind, files, read) in parsers() {
        let mut corruptor = Corruptor::new(2026);
        let mut refused = 0;
        for (name, valid) in &files {
            for _ in 0..each {
                if let Err(sentence) = read(name, &corruptor.corrupt(valid)) {
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

/// Writes the valid files as a fuzzing corpus if `MOCBAN_CORPUS` names a folder.
#[test]
fn the_fuzzing_corpus_holds_valid_files() {
    let dir = std::env::var_os("MOCBAN_CORPUS").map(std::path::PathBuf::from);
    let meshes = sample_files::meshes()
        .into_iter()
        .map(|(name, bytes)| (name, [b"\0", &bytes[..]].concat()));
    let mut all = vec![
        ("pair", meshes.collect()),
        ("verdicts", sample_files::verdicts()),
    ];
    all.extend(parsers().map(|(kind, files, _)| (kind, files)));
    for (kind, files) in all {
        assert!(!files.is_empty(), "{kind}");
        let Some(dir) = &dir else { continue };
        std::fs::create_dir_all(dir.join(kind)).expect("a folder");
        for (name, bytes) in files {
            std::fs::write(dir.join(kind).join(name), bytes).expect("written");
        }
    }
}

/// Found by fuzzing: text from a file reached the terminal with its control sequences.
#[test]
fn control_sequences_in_files_are_escaped_in_messages() {
    for (read, name, bytes) in [
        (
            read_mesh as Parser,
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

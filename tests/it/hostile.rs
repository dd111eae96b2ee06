//! Bad inputs. Each bad pair fails with one clear line and the right error class, and does not affect other pairs. A
//! bad manifest leaves no files.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use mocban::demo::{DemoOptions, Tier, write_dataset};
use mocban::manifest::{ManifestRow, parse_csv};
use mocban::raster::{Grid, png_grey8, png_rgb8};
use serde_json::Value;

use crate::cli::mocban;

/// Replaces the good mesh or the good print. `None` removes the file.
enum BadInput {
    Mesh(Option<Vec<u8>>),
    Print(Option<Vec<u8>>),
    MeshDirectory,
    PrintDirectory,
}

/// A bad pair with its expected error.
struct Case {
    id: &'static str,
    bad: BadInput,
    class: &'static str,
    message: &'static str,
}

fn case(id: &'static str, bad: BadInput, class: &'static str, message: &'static str) -> Case {
    Case {
        id,
        bad,
        class,
        message,
    }
}

fn cases() -> Vec<Case> {
    bad_meshes().into_iter().chain(bad_prints()).collect()
}

fn bad_meshes() -> Vec<Case> {
    let mesh = |bytes: Vec<u8>| BadInput::Mesh(Some(bytes));
    vec![
        case(
            "empty_mesh",
            mesh(vec![]),
            "bad_input",
            "is empty (0 bytes)",
        ),
        case(
            "truncated_stl",
            mesh(stl(&wavy_plate(6))[..400].to_vec()),
            "bad_input",
            "it holds 6 of 50 triangles",
        ),
        case(
            "nan_vertices",
            mesh(stl(&[[
                [0.0, 0.0, 0.0],
                [1.0, f32::NAN, 0.0],
                [0.0, 1.0, 0.0],
            ]])),
            "bad_input",
            "1 of 3 vertices have no position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside)",
        ),
        case(
            "no_faces",
            mesh([&b"none"[..], &stl(&[])[4..]].concat()),
            "bad_input",
            "has no faces",
        ),
        case(
            "one_line",
            mesh(points_on_a_line()),
            "bad_input",
            "lie on one line",
        ),
        case(
            "flat_plate",
            mesh(stl(&flat_plate(40))),
            "no_solution",
            "no carving found",
        ),
        case(
            "letter",
            mesh(b"Dear reader,\n".to_vec()),
            "bad_input",
            "the file is text",
        ),
        case("missing_mesh", BadInput::Mesh(None), "io", "is not there"),
        case(
            "mesh_folder",
            BadInput::MeshDirectory,
            "io",
            "is a directory, not a file",
        ),
    ]
}

fn bad_prints() -> Vec<Case> {
    let print = |bytes: Vec<u8>| BadInput::Print(Some(bytes));
    let plain = |level| png_grey8(&Grid::new(120, 120, level));
    vec![
        case(
            "empty_print",
            print(vec![]),
            "bad_input",
            "is empty (0 bytes)",
        ),
        case(
            "all_white",
            print(plain(255)),
            "bad_input",
            "print has no ink",
        ),
        case("all_black", print(plain(0)), "bad_input", "print has no"),
        case(
            "one_pixel",
            print(png_grey8(&Grid::new(1, 1, 9))),
            "bad_input",
            "print has no ink",
        ),
        case(
            "huge_header",
            print(huge_header()),
            "bad_input",
            "60000 x 60000 pixels",
        ),
        case(
            "text_as_png",
            print(b"not a picture\n".to_vec()),
            "bad_input",
            "the file is text",
        ),
        case(
            "bmp_as_png",
            print(b"BM\x36\0\0\0\0\0\0\0\x36\0\0\0".to_vec()),
            "bad_input",
            "the file is a BMP image; PNG, JPEG and TIFF images are read: convert it, such as with \
                ImageMagick: `magick mogrify -format png FILE`, and use the new file",
        ),
        case(
            "lfs_pointer",
            print(
                b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n"
                    .to_vec(),
            ),
            "bad_input",
            "the file is a pointer of Git LFS and does not hold the image; fetch the image with `git lfs pull`",
        ),
        case("missing_print", BadInput::Print(None), "io", "is not there"),
        case(
            "print_folder",
            BadInput::PrintDirectory,
            "io",
            "is a directory, not a file",
        ),
    ]
}

type Facet = [[f32; 3]; 3];

/// Encodes a binary STL.
fn stl(facets: &[Facet]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        for value in facet.as_flattened() {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn plate(side: u32, height: impl Fn(u32, u32) -> f32) -> Vec<Facet> {
    let at = |x: u32, y: u32| [x as f32, y as f32, height(x, y)];
    let mut facets = Vec::new();
    for y in 0..side - 1 {
        for x in 0..side - 1 {
            facets.push([at(x, y), at(x + 1, y), at(x, y + 1)]);
            facets.push([at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
    }
    facets
}

fn wavy_plate(side: u32) -> Vec<Facet> {
    plate(side, |x, y| ((x * 7 + y * 3) % 5) as f32)
}

fn flat_plate(side: u32) -> Vec<Facet> {
    plate(side, |_, _| 0.0)
}

fn points_on_a_line() -> Vec<u8> {
    let line = |i: i32| format!("{i} {} {}\n", 2 * i, -i);
    (0..5000).map(line).collect::<String>().into_bytes()
}

/// Returns the header of a PNG of 60,000 by 60,000 pixels without data.
fn huge_header() -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
    bytes.extend(60_000_u32.to_be_bytes());
    bytes.extend(60_000_u32.to_be_bytes());
    bytes.extend([8, 0, 0, 0, 0]);
    let checksum = 0xa5b9_2a9e_u32;
    bytes.extend(checksum.to_be_bytes());
    bytes
}

/// Returns a valid pair of the demo.
fn good_pair(dir: &Path) -> ManifestRow {
    let options = DemoOptions {
        pairs: 1,
        seed: 5,
        tier: Tier::Upright,
    };
    let files = write_dataset(dir, &options, &|| false).expect("a dataset");
    let manifest = fs::read(files.manifest).expect("a manifest");
    parse_csv(&manifest).expect("rows").remove(0)
}

/// Writes the files of a case and returns the paths of mesh and print.
fn write_case(dir: &Path, case: &Case, good: &ManifestRow) -> (PathBuf, PathBuf) {
    let put = |ending: &str, bytes: Option<&Vec<u8>>| {
        let name = format!("{}.{ending}", case.id);
        if let Some(bytes) = bytes {
            fs::write(dir.join(&name), bytes).expect("writes");
        }
        PathBuf::from(name)
    };
    match &case.bad {
        BadInput::Mesh(bytes) => (put("stl", bytes.as_ref()), good.print.clone()),
        BadInput::Print(bytes) => (good.mesh.clone(), put("png", bytes.as_ref())),
        BadInput::MeshDirectory => (PathBuf::from("meshes"), good.print.clone()),
        BadInput::PrintDirectory => (good.mesh.clone(), PathBuf::from("prints")),
    }
}

fn write_manifest(dir: &Path, good: &ManifestRow) {
    let mut text = String::from("id,mesh,print\n");
    let mut row = |id: &str, mesh: &Path, print: &Path| {
        writeln!(text, "{id},{},{}", mesh.display(), print.display()).expect("writes");
    };
    row("good", &good.mesh, &good.print);
    row("jpeg_named_png", &good.mesh, Path::new("jpeg.png"));
    for case in cases() {
        let (mesh, print) = write_case(dir, &case, good);
        row(case.id, &mesh, &print);
    }
    fs::write(dir.join("bad.csv"), text).expect("writes");
}

/// Writes the good print as a JPEG with the extension of a PNG.
fn write_misnamed_jpeg(dir: &Path, good: &ManifestRow) {
    let print = image::ImageReader::open(dir.join(&good.print))
        .and_then(image::ImageReader::with_guessed_format)
        .expect("opens")
        .decode()
        .expect("decodes");
    print
        .to_rgb8()
        .save_with_format(dir.join("jpeg.png"), image::ImageFormat::Jpeg)
        .expect("writes");
}

fn show(project: &Path, id: &str) -> Value {
    mocban(project, &["show", id, "--json"]).expect(0).json()
}

#[test]
fn every_bad_input_gives_one_line_and_does_not_affect_others() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let data = dir.path().join("data");
    let good = good_pair(&data);
    write_misnamed_jpeg(&data, &good);
    write_manifest(&data, &good);
    let imported = mocban(dir.path(), &["import", "data/bad.csv", "--allow-missing"]).expect(0);
    for id in ["missing_mesh", "missing_print"] {
        let warned = imported.err.lines().filter(|line| line.contains(id));
        assert!(warned.count() == 1, "{}", imported.err);
    }

    let run = mocban(dir.path(), &["run", "--progress", "plain"]).expect(3);
    for id in ["good", "jpeg_named_png"] {
        assert_eq!(show(dir.path(), id)["status"], "done", "{}", run.err);
    }
    for case in cases() {
        check(dir.path(), &case, &run.err);
    }
    let status = mocban(dir.path(), &["status", "--json"]).expect(0).json();
    assert_eq!(status["jobs"]["done"], 2);
    assert_eq!(status["jobs"]["quarantined"], cases().len());
}

fn check(project: &Path, case: &Case, run: &str) {
    let shown = show(project, case.id);
    let failure = &shown["failure"];
    let message = failure["message"].as_str().unwrap_or_default();
    assert_eq!(failure["class"], case.class, "{}: {message}", case.id);
    assert!(message.contains(case.message), "{}: {message}", case.id);
    assert_eq!(message.lines().count(), 1, "{message}");
    assert_eq!(shown["status"], "quarantined", "{}", case.id);
    assert!(run.contains(message), "{}: {message}\n{run}", case.id);
}

#[test]
fn retry_runs_a_pair_whose_missing_file_was_added() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let print = png_rgb8(&Grid::new(64, 64, [200; 3]));
    fs::write(dir.path().join("a.png"), print).expect("writes");
    fs::write(dir.path().join("a.csv"), "id,mesh,print\na,a.xyz,a.png\n").expect("writes");
    mocban(dir.path(), &["import", "a.csv", "--allow-missing"]).expect(0);
    mocban(dir.path(), &["run"]).expect(3);
    assert_eq!(show(dir.path(), "a")["failure"]["class"], "io");
    fs::write(dir.path().join("a.xyz"), points_on_a_line()).expect("writes");
    mocban(dir.path(), &["retry", "a"]).expect(0);
    mocban(dir.path(), &["run"]).expect(3);
    let message = show(dir.path(), "a")["failure"]["message"].to_string();
    assert!(message.contains("lie on one line"), "{message}");
}

#[test]
fn invalid_manifests_are_rejected_by_line_and_leave_no_files() {
    let good = "a,a.stl,a.png\n";
    for (header, rows, says) in [
        (
            "id,mesh,print",
            format!("{good}b,b.stl,b.png\n{good}"),
            "line 4: id \"a\" is already on line 2",
        ),
        (
            "id,mesh,print",
            format!("{good}b/c,b.stl,b.png\n"),
            "line 3: id \"b/c\" holds '/'",
        ),
        (
            "id,mesh,print",
            format!("{good},b.stl,b.png\n"),
            "line 3: the id is empty",
        ),
        (
            "id,mesh",
            "a,a.stl\n".to_owned(),
            "line 1: column \"print\" is missing",
        ),
        (
            "id,mesh,print,unit",
            "a,a.stl,a.png,ell\n".to_owned(),
            "line 2: \"ell\" is not a unit",
        ),
    ] {
        let dir = tempfile::tempdir().expect("a temporary directory");
        fs::write(dir.path().join("pairs.csv"), format!("{header}\n{rows}")).expect("writes");
        let refused = mocban(dir.path(), &["import", "pairs.csv", "-C", "project"]).expect(2);
        assert!(refused.err.contains(says), "{}", refused.err);
        assert!(!dir.path().join("project").exists(), "{says}");
        let left: Vec<_> = fs::read_dir(dir.path()).expect("lists").collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }
}

#[test]
fn a_rejected_manifest_does_not_change_an_existing_project() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    fs::write(dir.path().join("one.csv"), "id,mesh,print\na,a.stl,a.png\n").expect("writes");
    mocban(dir.path(), &["import", "one.csv", "--allow-missing"]).expect(0);
    let two = "id,mesh,print\nb,b.stl,b.png\na,elsewhere.stl,a.png\nb,c.stl,c.png\n";
    fs::write(dir.path().join("two.csv"), two).expect("writes");
    mocban(dir.path(), &["import", "two.csv"]).expect(2);
    let status = mocban(dir.path(), &["status", "--json"]).expect(0).json();
    assert_eq!(status["pairs"], 1);
    let mesh = show(dir.path(), "a")["mesh_path"].to_string();
    assert!(!mesh.contains("elsewhere"), "{mesh}");
}

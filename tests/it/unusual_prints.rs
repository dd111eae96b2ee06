//! Prints in files that other programs wrote, and folded prints, from the file to the result.

use std::fs;

use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;
use mocban::raster::{ImageLimits, decode};
use serde_json::Value;

use crate::cli::{empty, mocban};
use crate::like_plain::{assert_like_first, export, landmark_errors};
use crate::print_forms;

/// The metric whose threshold varies least with the print. For the others, colours that are rounded otherwise may choose
/// another level, which changes the `IoU` by up to 0.02.
const METRIC: &str = "relief";

/// Every form is aligned like its plain twin; the user learns that a print was turned, and why other files are refused.
#[test]
fn every_form_of_a_print_is_aligned_like_its_plain_twin() {
    let dir = empty();
    let pairs = PairGenerator::new(Tier::Upright, 5).with_vertices(Some(12_000));
    let pair = pairs.pair(0).expect("images encode");
    let print = decode(&pair.print, &ImageLimits::SUGGESTED).expect("an image");
    let groups = print_forms::groups(&print.rgb.to_rgb8());
    let refused = [
        (
            "pointer.png",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n".to_vec(),
            "does not hold the image; fetch the image with `git lfs pull`",
        ),
        (
            "pages.tif",
            print_forms::two_pages(&print.rgb.to_rgb8()),
            "the TIFF image has 2 pages, 2 of them of full size; a print is one page: save it as its own file",
        ),
    ];
    let mesh = MeshFormat::PlyLittleEndian.encode(&pair.mesh);
    fs::write(dir.path().join("scan.ply"), mesh).expect("written");
    let mut list = "id,mesh,print\n".to_owned();
    let forms = groups.iter().flatten().map(|form| (form.name, &form.bytes));
    for (name, bytes) in forms.chain(refused.iter().map(|(name, bytes, _)| (*name, bytes))) {
        fs::write(dir.path().join(name), bytes).expect("written");
        list.extend([name, ",scan.ply,", name, "\n"]);
    }
    fs::write(dir.path().join("pairs.csv"), list).expect("written");
    mocban(dir.path(), &["-C", "p", "import", "pairs.csv"]).expect(0);
    let run = mocban(dir.path(), &["-C", "p", "--progress", "none", "run", "-v"]).expect(3);
    let shown = |name: &str| mocban(dir.path(), &["-C", "p", "show", name]).expect(0).out;
    for (name, _, sentence) in &refused {
        let shown = shown(name);
        assert!(shown.contains(sentence), "{name}: {shown}");
    }
    export(dir.path());
    for forms in &groups {
        let names: Vec<&str> = forms.iter().map(|form| form.name).collect();
        assert_like_first(dir.path(), &names, &pair.truth, METRIC, &run.err);
        for form in forms {
            let shown = shown(form.name);
            let says_turned = shown.contains("turned upright by its EXIF orientation 6");
            assert_eq!(says_turned, form.is_turned, "{}: {shown}", form.name);
        }
    }
}

/// The pose of the larger part is right, the sentence says where the smaller part lies, and the result is trusted less.
#[test]
fn a_folded_print_is_aligned_on_its_larger_part_and_the_other_part_is_named() {
    let dir = empty();
    let pair = PairGenerator::new(Tier::Torn, 1).pair(9);
    let pair = pair.expect("images encode");
    let print = format!("print.{}", pair.print_extension);
    let mesh = MeshFormat::PlyLittleEndian.encode(&pair.mesh);
    fs::write(dir.path().join("scan.ply"), mesh).expect("written");
    fs::write(dir.path().join(&print), &pair.print).expect("written");
    let aligned = mocban(dir.path(), &["--json", "align", "scan.ply", &print]).expect(0);
    let found = aligned.json();
    assert!(found["displaced"].is_object(), "{found}");
    let confidence = found["confidence"].as_f64().expect("a confidence");
    assert!((0.5..0.9).contains(&confidence), "{confidence}");
    let start = "print: a part of the print with ";
    let is_sentence =
        |text: &&str| text.starts_with(start) && text.contains(" degrees from where ");
    let warnings = found["warnings"].as_array().expect("sentences").iter();
    let said = warnings
        .filter_map(Value::as_str)
        .filter(is_sentence)
        .count();
    assert_eq!(said, 1, "{found}");
    for error in landmark_errors(&found, &pair.truth) {
        let share = error / pair.truth.char_height_px;
        assert!(share < 0.03, "{share}");
    }
}

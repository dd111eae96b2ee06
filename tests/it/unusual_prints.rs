//! Prints in files that other programs wrote, and folded prints, from the file to the result.

use std::fs;

use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;
use mocban::raster::{Grid, ImageLimits, decode, png_rgb8};

use crate::cli::{empty, mocban};
use crate::like_plain::assert_like_first;
use crate::print_forms;

/// Every form is aligned like its plain twin; the user learns that a print was turned, and why other files are refused.
#[test]
fn every_form_of_a_print_is_aligned_like_its_plain_twin() {
    let dir = empty();
    let pairs = PairGenerator::new(Tier::Upright, 5).with_vertices(Some(12_000));
    let pair = pairs.pair(0).expect("images encode");
    let print = decode(&pair.print, &ImageLimits::SUGGESTED).expect("an image");
    let groups = print_forms::groups(&print.to_rgb8());
    let refused = [
        (
            "pointer.png",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n".to_vec(),
            "does not hold the image; fetch the image with `git lfs pull`",
        ),
        (
            "pages.tif",
            print_forms::two_pages(&print.to_rgb8()),
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
    for forms in &groups {
        let names: Vec<&str> = forms.iter().map(|form| form.name).collect();
        assert_like_first(dir.path(), &names, &pair.truth, &run.err);
        for form in forms {
            let shown = shown(form.name);
            let says_turned = shown.contains("turned upright by its EXIF orientation 6");
            assert_eq!(says_turned, form.is_turned, "{}: {shown}", form.name);
        }
    }
}

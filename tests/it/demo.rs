//! The built-in dataset: a seed always gives the same bytes, and every file can be read.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use mocban::demo::{DemoOptions, Tier, write_dataset};
use mocban::manifest::parse_csv;
use mocban::{mesh, raster};

/// Returns all files below a directory with their content.
fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the folder is there") {
            let path = entry.expect("the entry is readable").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path
                .strip_prefix(dir)
                .expect("below the folder")
                .display()
                .to_string();
            found.insert(name, fs::read(&path).expect("the file is readable"));
        }
    }
    found
}

fn made(tier: Tier, pairs: u64, seed: u64) -> (tempfile::TempDir, BTreeMap<String, Vec<u8>>) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_dataset(dir.path(), &DemoOptions { pairs, seed, tier }, &|| false)
        .expect("the dataset is written");
    let found = files(dir.path());
    (dir, found)
}

#[test]
fn same_seed_gives_the_same_bytes_and_another_seed_different_ones() {
    let (_one, first) = made(Tier::Hard, 2, 5);
    let (_two, second) = made(Tier::Hard, 2, 5);
    let (_three, other) = made(Tier::Hard, 2, 6);
    assert!(first == second, "the same options gave other bytes");
    assert!(first["truth.jsonl"] != other["truth.jsonl"]);
}

#[test]
fn a_pair_does_not_depend_on_the_number_of_pairs() {
    let (_one, few) = made(Tier::Pose, 1, 9);
    let (_two, more) = made(Tier::Pose, 2, 9);
    let id = "tops/pose-0000.png";
    assert_eq!(few[id], more[id]);
    let first_line = |files: &BTreeMap<String, Vec<u8>>| {
        files["truth.jsonl"]
            .split(|byte| *byte == b'\n')
            .next()
            .map(<[u8]>::to_vec)
    };
    assert_eq!(first_line(&few), first_line(&more));
}

#[test]
fn every_file_of_the_dataset_can_be_read() {
    let kinds = Tier::ALL.len() as u64 - 1;
    for (tier, pairs) in [(Tier::Hard, 2), (Tier::Real, 2), (Tier::All, kinds)] {
        let (dir, found) = made(tier, pairs, 2);
        let rows = parse_csv(&found["manifest.csv"]).expect("the manifest is sound");
        assert_eq!(rows.len() as u64, pairs);
        assert_eq!(
            found.len() as u64,
            pairs * 3 + 3,
            "{tier}: {:?}",
            found.keys()
        );
        for row in rows {
            let bytes = fs::read(dir.path().join(&row.mesh)).expect("the mesh is there");
            let name = row.mesh.display().to_string();
            let scan = mesh::read(&bytes, &name, &mesh::MeshLimits::SUGGESTED).expect("a mesh");
            assert!(scan.triangles.len() > 30_000, "{name}");
            let bytes = fs::read(dir.path().join(&row.print)).expect("the print is there");
            let print = raster::decode(&bytes, &raster::ImageLimits::SUGGESTED).expect("a picture");
            let tops =
                raster::decode_grey8(&found[&format!("tops/{}.png", row.name)]).expect("a mask");
            let size = [print.rgb.width(), print.rgb.height()];
            assert_eq!(size, [tops.width(), tops.height()]);
            let is_grid = row.name.to_string().starts_with("grid-print");
            let largest = if is_grid { 1300 } else { 400 };
            assert!(
                (100..=largest).contains(&size[0].max(size[1])),
                "{name}: {size:?}"
            );
        }
    }
}

#[test]
fn complete_dataset_is_kept_and_a_damaged_one_is_rewritten() {
    let options = DemoOptions {
        pairs: 1,
        seed: 3,
        tier: Tier::Upright,
    };
    let (dir, found) = made(options.tier, options.pairs, options.seed);
    let stray = dir.path().join("meshes/stray.stl");
    fs::write(&stray, "of a killed run").expect("a stray file");
    write_dataset(dir.path(), &options, &|| false).expect("found");
    assert!(stray.exists(), "a complete dataset was written again");
    fs::remove_file(dir.path().join("dataset.json")).expect("dataset.json exists");
    fs::write(dir.path().join("truth.jsonl"), "half a li").expect("the truth file is writable");
    write_dataset(dir.path(), &options, &|| false).expect("made");
    assert!(files(dir.path()) == found, "the rewritten dataset differs");
}

#[test]
fn real_tier_has_twenty_pairs_with_unchanged_photographs() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let options = DemoOptions {
        pairs: 99,
        seed: 1,
        tier: Tier::Real,
    };
    let dataset = write_dataset(dir.path(), &options, &|| false).expect("the dataset is written");
    assert_eq!(dataset.pairs, 20);
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/calligraphy");
    for index in 0..20 {
        let print = dir.path().join(format!("prints/real-{index:04}.png"));
        let photograph = assets.join(format!("{index:02}_real.png"));
        let read = |path: &Path| fs::read(path).expect("the picture is there");
        assert!(
            read(&print) == read(&photograph),
            "print {index} is not the photograph"
        );
    }
}

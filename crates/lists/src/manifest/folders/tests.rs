//! Tests of pairs from two directories.

use std::path::PathBuf;

use super::{FolderPairs, ListedFolder, ManifestError, PairingChanges};

fn files(names: &[&str]) -> Vec<PathBuf> {
    names.iter().map(PathBuf::from).collect()
}

fn pair_folders(meshes: &[PathBuf], prints: &[PathBuf]) -> Result<FolderPairs, ManifestError> {
    let listed = |root: &str, files: &[PathBuf]| ListedFolder {
        root: root.into(),
        files: files.to_vec(),
    };
    paired(&listed("m", meshes), &listed("p", prints))
}

/// Pairs files without changes. Refuses folders without a pair.
fn paired(meshes: &ListedFolder, prints: &ListedFolder) -> Result<FolderPairs, ManifestError> {
    let mut found = super::pair_folders(meshes, prints, &PairingChanges::default())?;
    match found.no_pair.take() {
        Some(why) => Err(why),
        None => Ok(found),
    }
}

/// Returns ids and blocks.
fn ids(found: &FolderPairs) -> Vec<(&str, &str)> {
    let rows = found.rows.iter();
    rows.map(|row| (row.name.as_str(), row.block.as_deref().unwrap_or_default()))
        .collect()
}

#[test]
fn folders_are_blocks_and_parts_of_ids() {
    let meshes = files(&[
        "m/b10/1.stl",
        "m/b2/10.stl",
        "m/b2/2.stl",
        "m/3.stl",
        "m/v1/b1/x.stl",
    ]);
    let prints = files(&[
        "p/b2/2.png",
        "p/b2/10.png",
        "p/b10/1.png",
        "p/3.png",
        "p/v1/b1/x.png",
        "p/b2/1.png",
    ]);
    let found = pair_folders(&meshes, &prints).expect("pairs");
    let expected = [
        ("3", ""),
        ("b10_1", "b10"),
        ("b2_2", "b2"),
        ("b2_10", "b2"),
        ("v1_b1_x", "v1_b1"),
    ];
    assert_eq!(ids(&found), expected);
    assert_eq!(found.prints_alone, files(&["p/b2/1.png"]));
}

#[test]
fn meshes_and_prints_may_be_in_one_folder_per_block() {
    let root = |names: &[&str]| ListedFolder {
        root: "d".into(),
        files: files(names),
    };
    for [mesh, print] in [
        ["d/b1/1.stl", "d/b1/1.png"],
        ["d/b1/stl/1.stl", "d/b1/print/1.png"],
        ["d/Meshes/b1/1.stl", "d/Prints/B1/1.png"],
        ["d/b1/quét/1.stl", "d/b1/in/1.png"],
        ["d/b1/Bản Quét/1.stl", "d/b1/BẢN IN/1.png"],
        ["d/b1/que\u{301}t/1.stl", "d/b1/a\u{309}nh in/1.png"],
        ["d/b1/scan/1.stl", "d/b1/ban in/1.png"],
        ["d/b1/lưới/1.stl", "d/b1/Ban_In/1.png"],
    ] {
        let both = root(&[mesh, print, "d/notes.txt"]);
        let found = paired(&both, &both).expect("a pair");
        assert_eq!(ids(&found), [("b1_1", "b1")], "{mesh}");
        assert_eq!(found.ignored, files(&["d/notes.txt"]));
        assert!(found.meshes_alone.is_empty() && found.prints_alone.is_empty());
    }
    // The folder may be in the names already.
    let found = pair_folders(&files(&["m/b1_1.stl"]), &files(&["p/b1/1.png"]));
    assert_eq!(ids(&found.expect("a pair")), [("b1_1", "b1")]);
}

#[test]
fn files_with_equal_ids_are_both_named() {
    let refusal = |meshes: &[&str]| {
        let refused = pair_folders(&files(meshes), &files(&["p/a1.png"]));
        refused.expect_err("twice").to_string()
    };
    assert_eq!(
        refusal(&["m/A1.stl", "m/a1.stl"]),
        "m/a1.stl: m/A1.stl has the same id \"A1\" (upper and lower case are equal); rename one of the meshes"
    );
    assert_eq!(
        refusal(&["m/a/b_1.stl", "m/a_b/1.stl"]),
        "m/a_b/1.stl: m/a/b_1.stl has the same id \"a_b_1\" (upper and lower case are equal); rename one of the meshes"
    );
    let found = pair_folders(&files(&["m/A1.STL"]), &files(&["p/a1.png"]));
    assert_eq!(ids(&found.expect("a pair")), [("A1", "")]);
}

#[test]
fn names_that_differ_in_zeros_or_accents_are_offered() {
    let meshes = files(&["m/117.stl", "m/chữ.stl", "m/5.stl"]);
    let prints = files(&["p/0117.png", "p/chu.png", "p/5.png"]);
    let found = pair_folders(&meshes, &prints).expect("a pair");
    assert_eq!(
        found.similar,
        [
            "m/117.stl and p/0117.png have similar names; rename one if they are a pair",
            "m/chữ.stl and p/chu.png have similar names; rename one if they are a pair"
        ]
    );
    let refused = pair_folders(&meshes[..1], &prints[..1]).expect_err("no pair");
    assert_eq!(
        refused.to_string(),
        "no mesh has the same file name as a print; m/117.stl and p/0117.png have similar names; rename one if they \
         are a pair"
    );
}

#[test]
fn files_pair_by_stem_in_the_order_of_their_numbers() {
    let meshes = files(&[
        "m/10.stl",
        "m/2.PLY",
        "m/a.obj",
        "m/a.mtl",
        "m/.DS_Store",
        "m/9.stl",
    ]);
    let prints = files(&["p/a.jpeg", "p/2.png", "p/10.tif", "p/77.png"]);
    let found = pair_folders(&meshes, &prints).expect("pairs");
    let names: Vec<_> = found.rows.iter().map(|row| row.name.as_str()).collect();
    assert_eq!(names, ["2", "10", "a"]);
    assert_eq!(found.rows[1].print, PathBuf::from("p/10.tif"));
    assert_eq!(found.meshes_alone, files(&["m/9.stl"]));
    assert_eq!(found.prints_alone, files(&["p/77.png"]));
    assert_eq!(found.ignored, files(&["m/a.mtl"]));
    let vietnamese = pair_folders(
        &files(&["m/chữ số 1.stl"]),
        &files(&["p/chu\u{31b}\u{303} so\u{302}\u{301} 1.png"]),
    );
    let vietnamese = vietnamese.expect("a pair");
    assert_eq!(vietnamese.rows[0].name.as_str(), "chữ số 1");
    let reversed: Vec<_> = meshes.into_iter().rev().collect();
    assert_eq!(pair_folders(&reversed, &prints).expect("pairs"), found);
}

#[test]
fn two_files_of_one_stem_are_both_named() {
    let error = pair_folders(&files(&["a.stl", "a.ply"]), &files(&["a.png"]));
    assert_eq!(
        error.expect_err("twice").to_string(),
        "a.stl: a.ply has the same stem; meshes are paired by stem"
    );
}

#[test]
fn a_folder_without_files_of_its_kind_is_named() {
    for (meshes, prints, expected) in [
        (vec!["a.stl"], vec!["a.stl"], "p holds no images"),
        (vec![], vec!["a.png"], "m holds no meshes"),
        (vec!["a.txt"], vec![], "m holds no meshes, and p no images"),
    ] {
        let refused = pair_folders(&files(&meshes), &files(&prints)).expect_err("no pair");
        assert_eq!(refused.to_string(), expected);
    }
}

#[test]
fn stems_that_are_not_valid_ids_are_reported_by_file() {
    let error = pair_folders(
        &files(&["x\ty.stl", "b.stl"]),
        &files(&["x\ty.png", "b.png"]),
    );
    assert_eq!(
        error.expect_err("a tab").to_string(),
        "x y.stl: id \"x y\" has a tab; remove it"
    );
    // There is no pair either, but the reason is the id.
    let only = pair_folders(&files(&["x\ty.stl"]), &files(&["x\ty.png"]));
    let only = only.expect_err("a tab").to_string();
    assert!(
        only.starts_with("x y.stl: id ") && only.lines().count() == 1,
        "{only}"
    );
    let none = pair_folders(&files(&["a.stl"]), &files(&["b.png"]));
    assert_eq!(
        none.expect_err("no pair").to_string(),
        "no mesh has the same file name as a print"
    );
    let apart = pair_folders(&files(&["m/F/3D/1.stl"]), &files(&["p/F/Anh/1.png"]));
    let apart = apart.expect_err("no pair").to_string();
    assert!(
        apart.contains("their folders \"F/3D\" and \"F/Anh\" differ"),
        "{apart}"
    );
}

#[test]
fn a_person_leaves_pairs_out_and_joins_files_without_a_partner() {
    let [meshes, prints] = [
        ("m", ["m/1.stl", "m/2.stl", "m/b/a.stl"]),
        ("p", ["p/1.png", "p/2.png", "p/x.png"]),
    ]
    .map(|(root, paths)| ListedFolder {
        root: root.into(),
        files: files(&paths),
    });
    let pairs = |left_out: &[&str], joined: &[(&str, &str)]| {
        let changes = PairingChanges {
            left_out: left_out.iter().map(|id| (*id).to_owned()).collect(),
            joined: joined
                .iter()
                .map(|(mesh, print)| ((*mesh).to_owned(), (*print).to_owned()))
                .collect(),
        };
        let found = super::pair_folders(&meshes, &prints, &changes);
        let found = found.map_err(|error| error.to_string())?;
        let rows = found.rows.iter();
        let rows = rows.map(|row| format!("{} {}", row.name, row.print.display()));
        Ok::<_, String>((rows.collect::<Vec<_>>().join(", "), found.no_pair))
    };
    let plain = |text: &str| Ok((text.to_owned(), None));
    assert_eq!(pairs(&[], &[]), plain("1 p/1.png, 2 p/2.png"));
    assert_eq!(pairs(&["1"], &[]), plain("2 p/2.png"));
    let joined = pairs(&[], &[("b/a.stl", "x.png")]);
    assert_eq!(joined, plain("1 p/1.png, 2 p/2.png, b_a p/x.png"));
    // Two pairs whose prints were named the wrong way round.
    let swapped = pairs(&["1", "2"], &[("1.stl", "2.png"), ("2.stl", "1.png")]);
    assert_eq!(swapped, plain("1 p/2.png, 2 p/1.png"));
    let (none, why) = pairs(&["1", "2"], &[]).expect("no pair");
    let why = why.expect("a reason").to_string();
    assert!(none.is_empty() && why.starts_with("all pairs are left out"));
    for (left_out, joined, expected) in [
        (&["7"][..], &[][..], "there is no pair \"7\" to leave out"),
        (
            &[],
            &[("1.stl", "x.png")],
            "m/1.stl: there is no such mesh without a print",
        ),
        (
            &[],
            &[("b/a.stl", "../x.png")],
            "p/../x.png: there is no such print without a mesh",
        ),
    ] {
        let refused = pairs(left_out, joined).expect_err("not there");
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn every_near_name_is_offered() {
    let offered = |meshes: &[&str], prints: &[&str]| {
        let (meshes, prints) = (files(meshes), files(prints));
        let both = |own: &[PathBuf], end: &str| {
            let mut all = own.to_vec();
            all.push(end.into());
            all
        };
        let found = pair_folders(&both(&meshes, "m/x.stl"), &both(&prints, "p/x.png"));
        found.expect("a pair").similar
    };
    let of = |mesh: &str, print: &str| {
        format!("{mesh} and {print} have similar names; rename one if they are a pair")
    };
    assert_eq!(
        offered(&["m/117.stl"], &["p/00117.png", "p/0117.png"]),
        [
            of("m/117.stl", "p/00117.png"),
            of("m/117.stl", "p/0117.png")
        ]
    );
    assert_eq!(
        offered(&["m/00117.stl", "m/0117.stl"], &["p/117.png"]),
        [
            of("m/00117.stl", "p/117.png"),
            of("m/0117.stl", "p/117.png")
        ]
    );
}

#[test]
fn the_first_near_names_are_named_and_the_others_counted() {
    let of = |mesh: &str, print: &str| format!("{mesh} and {print} have similar names");
    let rename = "rename one if they are a pair";
    let start = "no mesh has the same file name as a print";
    let refused = |prints: &[&str]| {
        let found = pair_folders(&files(&["m/7.stl"]), &files(prints));
        found.expect_err("no pair").to_string()
    };
    let [first, second, third] =
        ["p/007.png", "p/07.png", "p/0007.png"].map(|print| of("m/7.stl", print));
    assert_eq!(
        refused(&["p/07.png", "p/007.png"]),
        format!("{start}; {first}; {second}; {rename}")
    );
    let prints = [
        "p/07.png",
        "p/007.png",
        "p/0007.png",
        "p/00007.png",
        "p/000007.png",
    ];
    let [fifth, fourth] = ["p/000007.png", "p/00007.png"].map(|print| of("m/7.stl", print));
    assert_eq!(
        refused(&prints),
        format!("{start}; {fifth}; {fourth}; {third}; and 2 more; {rename}")
    );
    let meshes = files(&["m/7.stl", "m/x.stl"]);
    let prints = files(&[&prints[..], &["p/x.png"]].concat());
    let found = pair_folders(&meshes, &prints).expect("a pair");
    assert_eq!(
        found.similar,
        [
            format!("{fifth}; {rename}"),
            format!("{fourth}; {rename}"),
            format!("{third}; {rename}"),
            "2 more meshes and prints have similar names".to_owned()
        ]
    );
}

#[test]
fn the_nearest_file_of_the_same_name_is_named_if_folders_differ() {
    let root = ListedFolder {
        root: "d".into(),
        files: files(&[
            "d/b1/x/1.stl",
            "d/b1/y/1.png",
            "d/b2/x/1.stl",
            "d/b2/y/1.png",
        ]),
    };
    let refused = paired(&root, &root).expect_err("no pair").to_string();
    let reason = "d/b1/x/1.stl and d/b1/y/1.png have the same name, but their folders";
    assert!(refused.contains(reason), "{refused}");
}

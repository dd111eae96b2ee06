//! Which input files count as missing or changed.

use std::time::{Duration, Instant};

use super::{InputInspection, SampledInput, among, block_files, looked_for};
use mocban_catalog::{BlockAttributes, BlockInputVersions, InputVersion, KnownBlock};
use mocban_core::domain::{BlockId, BlockName, ContentHash};
use mocban_store::{Project, stat_input};

fn version(stat: &str) -> InputVersion {
    InputVersion {
        hash: ContentHash::of(b""),
        stat: stat.to_owned(),
    }
}

#[test]
fn the_labels_of_a_block_are_inspected_like_its_scan_and_page() {
    let read = |stat: &str| Some(version(stat));
    let block = KnownBlock {
        block: BlockId(1),
        attributes: BlockAttributes {
            name: BlockName::new("b").expect("an id"),
            mesh_path: "b.stl".to_owned(),
            page_path: "b.png".to_owned(),
            labels_path: Some("b.json".to_owned()),
            unit: None,
            side: None,
            meta: None,
        },
        inputs: BlockInputVersions {
            mesh: read("1"),
            page: None,
            labels: read("2"),
        },
    };
    let expected = [("b.stl", read("1")), ("b.png", None), ("b.json", read("2"))];
    assert_eq!(
        block_files(block),
        expected.map(|(path, read)| (path.to_owned(), read))
    );
}

#[test]
fn changed_and_missing_files_are_counted_and_copies_are_not() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = Project::at(dir.path());
    let files = ["a.stl", "b.stl", "c.stl"].map(|name| {
        let path = dir.path().join(name);
        std::fs::write(&path, "x").expect("written");
        let path = path.display().to_string();
        let stat = stat_input(&project.input(&path)).expect("a file");
        SampledInput {
            owner: 0,
            path,
            read: version(&stat),
        }
    });
    let later = Instant::now() + Duration::from_hours(1);
    let none = InputInspection::default();
    let sound = InputInspection {
        looked_at: 3,
        ..none.clone()
    };
    assert_eq!(among(&project, &files, later), sound);
    // Another file with the same size, as in a copy of the folder.
    std::fs::write(dir.path().join("new.stl"), "y").expect("written");
    std::fs::rename(dir.path().join("new.stl"), dir.path().join("a.stl")).expect("moved");
    assert_eq!(among(&project, &files, later), sound);
    std::fs::write(dir.path().join("b.stl"), "longer").expect("written");
    std::fs::remove_file(dir.path().join("c.stl")).expect("removed");
    let InputInspection {
        missing, changed, ..
    } = among(&project, &files, later);
    let (missing, changed) = (missing.expect("one"), changed.expect("one"));
    assert_eq!((missing.missing, missing.looked_at), (1, 3));
    assert!(missing.first.ends_with("c.stl"), "{missing}");
    assert_eq!((changed.changed, changed.looked_at), (1, 3));
    assert!(changed.first.ends_with("b.stl"), "{changed}");
    let mut unread = files.clone();
    unread[1].read.stat.clear();
    assert_eq!(among(&project, &unread, later).changed, None);
    assert_eq!(among(&project, &files, Instant::now()), none, "it is over");
}

#[test]
fn a_missing_folder_is_named_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = Project::at(dir.path());
    let file = |owner, path: &str, read| SampledInput {
        owner,
        path: dir.path().join(path).display().to_string(),
        read,
    };
    let later = Instant::now() + Duration::from_hours(1);
    let find = |files: &[SampledInput]| among(&project, files, later).missing;
    let scans = [
        file(0, "scans/a/1.stl", version("")),
        file(1, "scans/b/2.stl", InputVersion::gone()),
    ];
    let found = find(&scans).expect("two files");
    let folder = dir.path().join("scans").display().to_string();
    let end = format!(" (pairs or blocks: 2), and so is the folder {folder}");
    assert!(found.found().ends_with(&end), "{found}");
    assert!(found.to_string().contains("--allow-changed-files"));
    assert!(found.explains(&format!("{} is not there", scans[1].path)));
    assert!(!found.explains("other/1.stl is not there"));
    let both = [scans[0].clone(), file(2, "prints/1.png", version(""))];
    let found = find(&both).expect("two files");
    assert_eq!(found.folders.len(), 2, "{found}");
    assert!(found.found().contains("and so are the folders "), "{found}");
    // A folder that is there is not named.
    let found = find(&[file(0, "1.stl", version(""))]).expect("a file");
    assert!(found.folders.is_empty() && found.found().contains(", first "));
    assert_eq!(find(&[file(0, "1.stl", InputVersion::gone())]), None);
}

#[test]
fn a_print_that_no_run_has_looked_for_counts_if_its_scan_is_gone() {
    let inputs =
        |scan: Option<InputVersion>| vec![("1.stl".to_owned(), scan), ("1.png".to_owned(), None)];
    let gone = InputVersion::gone;
    let both = [("1.stl", gone()), ("1.png", gone())];
    let both = both.map(|(path, read)| (path.to_owned(), read));
    assert_eq!(looked_for(inputs(Some(gone()))), both);
    let read = version("1");
    let scan = [("1.stl".to_owned(), read.clone())];
    assert_eq!(looked_for(inputs(Some(read))), scan);
    assert!(looked_for(inputs(None)).is_empty());
}

//! Scans and prints whose folder has moved: their folder is named once, with what to do.

use crate::check::{at, done};

#[test]
fn a_moved_folder_is_named_once_and_its_new_place_can_be_imported() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let project = done(dir.path());
    let (data, moved) = (project.dir().join("data"), dir.path().join("away"));
    std::fs::rename(&data, &moved).expect("moved");
    let sentence = format!(
        "4 of 4 input files that were looked at are missing or have moved (pairs or blocks: 2), and so is the folder {}; `check --json` \
         lists all; put them back, or import them from their new place (`import LIST --allow-changed-files`)",
        data.display()
    );
    let path = |name: &str| {
        dir.path()
            .join(name)
            .to_str()
            .expect("a path in UTF-8")
            .to_owned()
    };
    let output = path("export");
    let export = ["export", "-o", &output];
    let exported = at(&project, &export).expect(3);
    for (shown, command) in [
        (exported.err, "export"),
        (at(&project, &["run"]).expect(0).err, "run"),
        (at(&project, &["check"]).expect(0).err, "check"),
        (at(&project, &["status"]).expect(0).out, "status"),
    ] {
        assert_eq!(shown.matches(&sentence).count(), 1, "{command}: {shown}");
        assert!(!shown.contains("is not there"), "{command}: {shown}");
    }
    let (meshes, prints) = (path("away/meshes"), path("away/prints"));
    let import = [
        "import",
        "--meshes",
        &meshes,
        "--prints",
        &prints,
        "--allow-changed-files",
    ];
    at(&project, &import).expect(0);
    at(&project, &["run"]).expect(0);
    let exported = at(&project, &export).expect(0);
    assert!(!exported.err.contains("have moved"), "{}", exported.err);
}

#[test]
fn a_run_that_finds_no_file_names_the_missing_folders() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let list = "id,mesh,print\na,scans/1.stl,prints/1.png\nb,scans/2.stl,prints/2.png\n";
    std::fs::write(dir.path().join("pairs.csv"), list).expect("a list");
    let on = |args: &[&str]| crate::cli::mocban(dir.path(), &[&["-C", "p"][..], args].concat());
    on(&["import", "pairs.csv", "--allow-missing"]).expect(0);
    let ran = on(&["--progress", "none", "run"]).expect(3);
    let said = "4 of 4 input files that were looked at are missing or have moved (pairs or blocks: 2), and so are the folders ";
    assert_eq!(ran.err.matches(said).count(), 1, "{}", ran.err);
    for folder in ["prints", "scans"] {
        let folder = dir.path().join(folder).display().to_string();
        assert!(ran.err.contains(&folder), "{folder}: {}", ran.err);
    }

    // Files that no run has read are not changed.
    std::fs::create_dir(dir.path().join("new")).expect("a folder");
    for name in ["1.stl", "1.png", "2.stl", "2.png"] {
        std::fs::write(dir.path().join("new").join(name), "x").expect("written");
    }
    let list = "id,mesh,print\na,new/1.stl,new/1.png\nb,new/2.stl,new/2.png\n";
    std::fs::write(dir.path().join("new.csv"), list).expect("a list");
    on(&["import", "new.csv", "--allow-changed-files"]).expect(0);
    let checked = on(&["check"]);
    assert!(!checked.out.contains("changed since"), "{}", checked.out);
}

#[test]
fn files_of_a_project_without_a_list_are_imported_as_before() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let data = done(dir.path()).dir().join("data");
    let on = |args: &[&str]| crate::cli::mocban(dir.path(), &[&["-C", "q"][..], args].concat());
    let folders = ["meshes", "prints"].map(|name| data.join(name));
    let [meshes, prints] = folders
        .each_ref()
        .map(|folder| folder.to_str().expect("UTF-8"));
    on(&["import", "--meshes", meshes, "--prints", prints]).expect(0);
    on(&["run", "upright-0000", "--set", "depth.longest_px=96"]).expect(0);
    std::fs::rename(&data, dir.path().join("away")).expect("moved");
    let status = on(&["status"]).expect(0).out;
    let advice = "(`import --meshes DIR --prints DIR --allow-changed-files`)";
    assert!(status.contains(advice), "{status}");
}

//! Checks that the archive of a release contains every file that the installation guides name.

use std::collections::BTreeSet;

use crate::source_text::package_dir;

/// Pages that name files of the program, each with the headings of sections about a checkout, which has all files.
const GUIDES: [(&str, &[&str]); 2] = [
    ("docs/guides/install.md", &["Wheel", "Docker", "Source"]),
    ("docs/vi/ung-dung.md", &[]),
];
/// Folders of the repository in which these files are.
const FOLDERS: [&str; 2] = ["deploy/", "assets/"];

/// Returns a text file of the repository.
fn read(name: &str) -> String {
    std::fs::read_to_string(package_dir().join(name)).expect("UTF-8")
}

#[test]
fn files_that_guides_copy_are_in_the_archive() {
    let archive = read("deploy/archive");
    for (name, of_checkout) in GUIDES {
        let guide = read(name);
        let sections = guide.split("\n## ").filter(|section| {
            let heading = section.lines().next().unwrap_or_default();
            !of_checkout.contains(&heading)
        });
        let words =
            sections.flat_map(|section| section.split(|c: char| c.is_whitespace() || c == '`'));
        let is_of_program = |word: &&str| FOLDERS.iter().any(|folder| word.starts_with(*folder));
        let named: BTreeSet<&str> = words.filter(is_of_program).collect();
        assert_eq!(
            named.len(),
            2,
            "the entry of the menu and its picture: {named:?}"
        );
        for file in named {
            assert!(package_dir().join(file).is_file(), "{name}: {file}");
            let (folder, _) = file.rsplit_once('/').expect("a folder");
            let line = format!("cp {file} \"$temporary/$name/{folder}\"");
            assert!(
                archive.lines().any(|known| known == line),
                "{name} names {file}, which deploy/archive does not pack"
            );
            let created = archive.lines().find(|line| line.starts_with("mkdir "));
            let folder = format!("\"$temporary/$name/{folder}\"");
            assert!(
                created.is_some_and(|line| line.contains(&folder)),
                "{folder}"
            );
        }
    }
}

#[test]
fn the_entry_of_the_menu_starts_the_app_with_a_picture() {
    let entry = read("deploy/mocban.desktop");
    for line in ["Exec=mocban app", "Icon=mocban", "Terminal=true"] {
        assert!(entry.lines().any(|known| known == line), "{line}");
    }
    assert!(read("docs/guides/install.md").contains("apps/mocban.svg"));
}

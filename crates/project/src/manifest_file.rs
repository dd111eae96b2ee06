//! Reads a manifest or lists two directories, and passes the content to the parsers in `manifest`.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::exit::Refusal;
use super::files;
use super::folder_files::{links_sentence, list_with_links};
use super::input_paths::in_existing_form;
use super::missing_files::locate_file;
use super::repeated_files::RepeatedFiles;
use super::unread_files::{UnreadFiles, UnreadRows};
use super::unusable_files::FileSearches;
use crate::error::ProjectResult;
use crate::pair_choices::{PairChoices, RowsHash};
use crate::renamed_columns::renamed_columns;
use mocban_core::domain::spelling::quoted;
use mocban_core::domain::{ContentHash, FileKind, LengthUnit, PairName, first_names};
use mocban_lists::manifest::{
    ChangedIds, ChosenColumns, DecimalIds, ListedFolder, ManifestError, ManifestRow,
    MisspeltColumns, PairingChanges, ReadRows, RowIds, pair_folders, read_csv_as, read_jsonl,
};
use mocban_store::Project;

/// Beginnings of the warnings about meshes alone, prints alone, and other files.
pub const IGNORED: [&str; 3] = [
    "ignored, mesh without print",
    "ignored, print without mesh",
    "ignored, neither mesh nor print",
];

/// Valid pairs to import. A manifest file is kept as text, and its rows are parsed again when they are needed.
#[derive(Debug)]
pub struct Listing {
    source: ListingSource,
    /// The ids of all pairs.
    pub ids: RowIds,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
    /// Which columns were read under other names.
    pub renamed: Option<String>,
    /// Meshes and prints of directories without a partner, by their paths below the directories.
    pub alone: [Vec<String>; 2],
    /// Says why directories have no pair.
    pub no_pair: Option<Refusal>,
    /// Says which rows of a list are refused. The others are passed on, so that their missing files can be named too.
    pub refused: Option<Refusal>,
    /// Label of row numbers in messages: `pairs.csv: line`, or `pair` for directories.
    row_label: String,
}

/// What was found out about all rows of a listing.
#[derive(Debug)]
pub struct ListedRows {
    /// A hash of the rows as they are listed.
    pub hash: ContentHash,
    /// Warnings about files that cannot be inputs, such as pointers of Git LFS.
    pub unusable: Vec<String>,
}

/// Where the rows come from.
#[derive(Debug)]
enum ListingSource {
    /// A list, and the directory that its paths are relative to.
    List {
        bytes: Vec<u8>,
        parse: RowParser,
        columns: ChosenColumns,
        /// Ids that are left out.
        left_out: BTreeSet<String>,
        folder: PathBuf,
    },
    /// Two directories.
    Folders(Vec<ManifestRow>),
}

/// Calls a function for each row; returns the ids of all rows, and which columns have other names.
type RowParser =
    fn(&[u8], &ChosenColumns, &mut dyn FnMut(ManifestRow)) -> Result<ReadRows, ManifestError>;

/// Refuses a manifest as a whole.
pub fn refuse(from: &Path, problems: &impl Display) -> Refusal {
    let problems = problems.to_string().replace('\n', "\n  ");
    let from = from.display();
    Refusal::Usage(format!(
        "{from} is refused, nothing was imported:\n  {problems}"
    ))
}

impl Listing {
    /// Parses the content of a CSV or JSON Lines file as a person has chosen. If its extension is unknown, the first
    /// character decides the format. Rows may be refused.
    ///
    /// # Errors
    /// Returns an error if the names of its files say that none of its pairs can be read, or there is nothing of what was
    /// chosen.
    pub fn from_bytes(file: &Path, bytes: Vec<u8>, choices: &PairChoices) -> ProjectResult<Self> {
        let shown = file.display();
        let parse: RowParser = if files::is_jsonl(file, &bytes) {
            |bytes, _columns, each| read_jsonl(bytes, each)
        } else {
            read_csv_as
        };
        let (mut misspelt, mut unread) = (MisspeltColumns::default(), UnreadRows::default());
        let left_out: BTreeSet<String> = choices.changes.left_out.iter().cloned().collect();
        let (mut repeated, mut ids) = (RepeatedFiles::default(), ChangedIds::default());
        let (mut decimal_ids, mut blocks) = (DecimalIds::default(), ChangedIds::of_blocks());
        let mut each = |row: ManifestRow| {
            misspelt.add(&row);
            ids.add(row.line, row.name.as_str(), [&row.mesh, &row.print]);
            decimal_ids.add(row.line, row.name.as_str());
            if let Some(block) = &row.block {
                blocks.add(row.line, block, [&row.mesh, &row.print]);
            }
            unread.add(&row);
            if !left_out.contains(row.name.as_str()) {
                repeated.add(row.line, row.name.as_str(), &row.mesh, &row.print);
            }
        };
        let columns = choices.columns.clone();
        let parsed = parse(&bytes, &columns, &mut each);
        let refused = parsed.as_ref().err();
        let refused = refused.map(|problems| refuse(file, problems));
        let read = parsed.unwrap_or_default();
        let mut warnings = misspelt.warnings();
        warnings.extend(read.unnamed.warning());
        warnings.extend(read.formula_errors.warning());
        warnings.extend(read.unusual_cells.warnings());
        warnings.extend(read.unread_columns.warnings());
        warnings.extend(ids.warning());
        warnings.extend(blocks.warning());
        warnings.extend(decimal_ids.warning(&read.ids));
        match unread.warnings() {
            Ok(unread) => warnings.extend(unread),
            Err(sentences) if refused.is_none() => return Err(refuse(file, &sentences).into()),
            Err(_) => {}
        }
        warnings.extend(repeated.warning("pairs with the same mesh and print"));
        let renamed = renamed_columns(&read.renamed);
        let has = |id: &&String| PairName::new(id).is_ok_and(|name| read.ids.contains(&name));
        if refused.is_none()
            && let Some(id) = left_out.iter().find(|id| !has(id))
        {
            let text = format!("there is no pair {} to leave out", quoted(id));
            return Err(refuse(file, &text).into());
        }
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self {
            source: ListingSource::List {
                bytes,
                parse,
                columns,
                left_out,
                folder,
            },
            ids: read.ids,
            warnings,
            renamed,
            alone: [Vec::new(), Vec::new()],
            no_pair: None,
            refused,
            row_label: format!("{shown}: line"),
        })
    }

    /// Pairs each mesh of one directory with the print of the same folder and file stem in the other directory, except for
    /// changes. There may be no pair.
    ///
    /// # Errors
    /// Returns an error if a directory cannot be listed, two files of one directory have the same stem, or the files of a
    /// change are not there.
    pub fn from_folders(
        meshes: &Path,
        prints: &Path,
        unit: Option<LengthUnit>,
        changes: &PairingChanges,
    ) -> ProjectResult<Self> {
        let listed = |root: &Path| {
            let root = in_existing_form(root);
            let found = list_with_links(&root)?;
            let files = found.files;
            Ok::<_, Refusal>((ListedFolder { root, files }, found.links))
        };
        let (mesh_folder, links) = listed(meshes)?;
        let (print_folder, more_links) = listed(prints)?;
        let mut unread = UnreadFiles::of_folder(&mesh_folder.files, FileKind::mesh_advice);
        unread.append(UnreadFiles::of_folder(
            &print_folder.files,
            FileKind::image_advice,
        ));
        unread
            .sentences
            .extend(links_sentence([links, more_links].concat()));
        let refuse_both = |problems: ManifestError| {
            let lines = [&[problems.to_string()][..], &unread.sentences].concat();
            refuse(meshes, &lines.join("\n"))
        };
        let found = pair_folders(&mesh_folder, &print_folder, changes).map_err(&refuse_both)?;
        let no_pair = found.no_pair.map(refuse_both);
        let mut others = found.ignored;
        others.retain(|path| !unread.paths.contains(path));
        let mut rows = found.rows;
        for row in &mut rows {
            row.unit = unit;
        }
        let warnings = [
            ignored_files(IGNORED[0], &found.meshes_alone),
            ignored_files(IGNORED[1], &found.prints_alone),
            ignored_files(IGNORED[2], &others),
        ];
        let warnings = warnings.into_iter().flatten().chain(unread.sentences);
        let alone = [
            below(&found.meshes_alone, &mesh_folder.root),
            below(&found.prints_alone, &print_folder.root),
        ];
        Ok(Self {
            ids: rows.iter().map(|row| &row.name).collect(),
            source: ListingSource::Folders(rows),
            warnings: warnings.chain(found.similar).collect(),
            renamed: None,
            alone,
            no_pair,
            refused: None,
            row_label: "pair".to_owned(),
        })
    }

    /// Calls `each` for every row, with a message for each missing file. Paths start with the manifest's directory.
    /// Paths below a named root of `project` stay as they are.
    pub fn rows(
        &self,
        project: &Project,
        mut each: impl FnMut(ManifestRow, Vec<String>),
    ) -> ListedRows {
        let mut searches = FileSearches::default();
        let mut each = |mut row: ManifestRow| {
            let has_two_paths = row.mesh.as_os_str() != row.print.as_os_str();
            let place = (self.row_label.as_str(), row.line);
            let mut locate =
                |kind, path| locate_file(place, kind, path, &row.name, project, &mut searches);
            let mesh = locate("mesh", &mut row.mesh);
            let print = locate("print", &mut row.print);
            let missing = match (mesh, print) {
                (Ok(mesh), Ok(print)) => {
                    if has_two_paths {
                        let files = [mesh, print];
                        searches.linked.add(row.line, row.name.as_str(), &files);
                    }
                    Vec::new()
                }
                (mesh, print) => [mesh.err(), print.err()].into_iter().flatten().collect(),
            };
            each(row, missing);
        };
        let hash = match &self.source {
            ListingSource::Folders(rows) => {
                let mut hash = RowsHash::new(Path::new(""));
                for row in rows {
                    // Their unit is chosen with the import.
                    hash.add(row, false);
                    each(row.clone());
                }
                hash.value()
            }
            ListingSource::List {
                bytes,
                parse,
                columns,
                left_out,
                folder,
            } => {
                let mut hash = RowsHash::new(folder);
                let parsed = parse(bytes, columns, &mut |mut row| {
                    if left_out.contains(row.name.as_str()) {
                        return;
                    }
                    hash.add(&row, true);
                    for path in [&mut row.mesh, &mut row.print] {
                        if !is_below_root(path, project) {
                            *path = folder.join(&*path);
                        }
                    }
                    each(row);
                });
                debug_assert_eq!(parsed.is_err(), self.refused.is_some());
                hash.value()
            }
        };
        let unusable = searches.warnings();
        ListedRows { hash, unusable }
    }
}

/// Returns whether a path of a list is below a named root of a project, so that it does not depend on the folder of the list.
pub(crate) fn is_below_root(path: &Path, project: &Project) -> bool {
    path.to_str()
        .is_some_and(|path| project.is_below_root(path))
}

/// Reads a list of pairs.
pub(crate) fn list_content(file: &Path) -> ProjectResult<Vec<u8>> {
    let shown = file.display();
    if file.is_dir() {
        let text =
            format!("{shown} is a directory; name two directories with --meshes and --prints");
        return Err(Refusal::Usage(text).into());
    }
    Ok(files::read(file)?)
}

/// Returns paths below a folder that are UTF-8.
fn below(paths: &[PathBuf], root: &Path) -> Vec<String> {
    let paths = paths.iter().filter_map(|path| path.strip_prefix(root).ok());
    paths
        .filter_map(|path| path.to_str().map(str::to_owned))
        .collect()
}

/// Returns a reason with the first paths: `ignored, mesh without print: a.stl, b.stl and 3 more`.
fn ignored_files(reason: &str, paths: &[PathBuf]) -> Option<String> {
    const MAX_NAMES: usize = 5;
    let names = paths.iter().map(|path| path.display().to_string());
    let names = first_names(&names.collect::<Vec<_>>(), MAX_NAMES);
    (!paths.is_empty()).then(|| format!("{reason}: {names}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Listing, PairChoices, Project, ProjectResult, list_content};

    fn from_file(file: &Path) -> ProjectResult<Listing> {
        Listing::from_bytes(file, list_content(file)?, &PairChoices::default())
    }

    #[test]
    fn a_long_path_is_cut_in_messages() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        let path = "d/".repeat(2000);
        std::fs::write(&file, format!("id,mesh,print\na,{path}a,{path}b\n")).expect("written");
        let listing = from_file(&file).expect("valid");
        let mut missing = Vec::new();
        listing.rows(&Project::at(dir.path()), |_, lines| missing.extend(lines));
        assert_eq!(missing.len(), 2);
        for line in missing {
            assert!(line.len() < 600 && line.contains("... of a "), "{line}");
        }
    }

    #[test]
    fn the_same_files_under_two_ids_are_counted_with_the_first() {
        let list =
            "id,mesh,print\na,a.stl,a.png\nb,./a.stl,a.png\nc,a.stl,c.png\nd,x/../a.stl,a.png\n";
        let read = |choices: &PairChoices| {
            let listing = Listing::from_bytes(Path::new("pairs.csv"), list.into(), choices);
            listing.expect("valid").warnings
        };
        let sentence =
            "pairs with the same mesh and print as an earlier one: 2, first b, as on line 2";
        assert_eq!(read(&PairChoices::default()), [sentence]);
        let mut choices = PairChoices::default();
        choices.changes.left_out = ["b", "d"].map(str::to_owned).into();
        assert_eq!(read(&choices), [""; 0]);
    }

    #[test]
    fn paths_are_relative_to_the_manifest_and_missing_files_are_named_by_line() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\na,a.stl,pairs.csv\n").expect("a small file");
        let listing = from_file(&file).expect("valid");
        let (mut meshes, mut missing) = (Vec::new(), Vec::new());
        listing.rows(&Project::at(dir.path()), |row, lines| {
            meshes.push(row.mesh);
            missing.extend(lines);
        });
        assert_eq!(meshes, [dir.path().join("a.stl")]);
        assert_eq!(missing.len(), 1);
        assert!(
            missing[0].contains("pairs.csv: line 2: mesh "),
            "{missing:?}"
        );
        std::fs::write(dir.path().join("Á.stl"), "").expect("written");
        listing.rows(&Project::at(dir.path()), |_, lines| missing.extend(lines));
        assert!(
            missing[1].ends_with(" does not exist; there is Á.stl"),
            "{missing:?}"
        );
        std::fs::create_dir(dir.path().join("d.stl")).expect("a folder");
        let list = "id,mesh,print\na,d.stl,https://museum.vn/1.png\nb,file:///d/1.stl,b.png\nc,a\t.stl,c.csv\n";
        std::fs::write(&file, list).expect("written");
        let mut odd = Vec::new();
        let listing = from_file(&file).expect("valid");
        listing.rows(&Project::at(dir.path()), |_, lines| odd.extend(lines));
        for (line, end) in odd.iter().zip([
            "d.stl of a is a folder, not a file",
            "https://museum.vn/1.png of a is a web address; download the file and write the path of the copy",
            "file:///d/1.stl of b does not exist; write its path without file://",
            "b.png of b does not exist",
            " of c does not exist; its path has a tab: remove it",
        ]) {
            assert!(line.ends_with(end), "{line}");
        }
        assert_eq!(odd.len(), 6, "{odd:?}");
        let refused = from_file(dir.path()).expect_err("a directory");
        assert!(refused.to_string().contains("--meshes"), "{refused}");
    }

    #[test]
    fn pointers_in_place_of_files_are_counted() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        for (name, content) in [("a.stl", pointer), ("a.png", pointer), ("b.png", "x")] {
            std::fs::write(dir.path().join(name), content).expect("written");
        }
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\na,a.stl,a.png\nb,a.stl,b.png\n").expect("written");
        let listing = from_file(&file).expect("valid");
        let read = listing.rows(&Project::at(dir.path()), |_, lines| {
            assert!(lines.is_empty(), "{lines:?}");
        });
        let warning = read.unusable.concat();
        assert!(warning.contains("labels: 3, the first"), "{warning}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_a_missing_file_is_named() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        std::fs::write(&file, "id,mesh,print\na,a.stl,pairs.csv\n").expect("written");
        std::os::unix::fs::symlink("gone.stl", dir.path().join("a.stl")).expect("a link");
        let mut missing = Vec::new();
        let listing = from_file(&file).expect("valid");
        listing.rows(&Project::at(dir.path()), |_, lines| missing.extend(lines));
        let end = "a.stl of a is a link to a file that does not exist";
        assert!(missing[0].ends_with(end), "{missing:?}");
    }
}

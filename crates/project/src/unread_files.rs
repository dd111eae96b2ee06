//! Says once per format, instead of once per file, that files of a folder or a list are not read.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::Metadata;
use std::path::{Path, PathBuf};

use super::input_paths::FoundFile;
use mocban_core::domain::FileKind;
use mocban_core::domain::spelling::quoted;
use mocban_lists::manifest::ManifestRow;

/// Begins the sentences of a folder, whose other files are imported without these.
const IGNORED: &str = "ignored, ";

/// Extensions of archives.
const ARCHIVES: [(&str, FileKind); 6] = [
    ("zip", FileKind::Other("a ZIP archive")),
    ("7z", FileKind::Other("a 7-Zip archive")),
    ("rar", FileKind::Other("a RAR archive")),
    ("tar", FileKind::Other("a TAR archive")),
    ("tgz", FileKind::Other("a gzip archive")),
    ("gz", FileKind::Other("a gzip archive")),
];

/// What to do with an archive.
const UNPACK: &str = "unpack it, and import the files in it";

/// Files in formats that are not read, by their names.
pub(crate) struct UnreadFiles {
    pub(crate) paths: BTreeSet<PathBuf>,
    /// One sentence per format.
    pub(crate) sentences: Vec<String>,
}

impl UnreadFiles {
    /// Finds the files of a folder whose format is not read and for which there is advice.
    pub(crate) fn of_folder(folder: &[PathBuf], advice: fn(FileKind) -> Option<String>) -> Self {
        Self::of(folder, IGNORED, advice)
    }

    /// Finds files like [`Self::of_folder`], with sentences that begin with `start`.
    fn of<'a>(
        files: impl IntoIterator<Item = &'a PathBuf>,
        start: &str,
        advice: fn(FileKind) -> Option<String>,
    ) -> Self {
        let mut formats: BTreeMap<&'static str, (FileKind, String, Vec<&PathBuf>)> =
            BTreeMap::new();
        for path in files {
            let kind = unread_kind(path);
            if let Some((kind, advice)) =
                kind.and_then(|kind| Some((kind, advice_on(kind, advice)?)))
            {
                let format = formats.entry(kind.name());
                let (_, _, paths) = format.or_insert((kind, advice, Vec::new()));
                paths.push(path);
            }
        }
        let mut found = Self {
            paths: BTreeSet::new(),
            sentences: Vec::new(),
        };
        for (kind, advice, mut paths) in formats.into_values() {
            paths.sort();
            let first = paths[0].display();
            let more = match paths.len() - 1 {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let advice = with_patterns(&advice, &paths);
            let sentence = format!("{start}{kind} is not read: {first}{more}; {advice}");
            found.sentences.push(sentence);
            found.paths.extend(paths.into_iter().cloned());
        }
        found
    }

    /// Adds the files of another folder, which may be the same one.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.paths.append(&mut other.paths);
        other
            .sentences
            .retain(|sentence| !self.sentences.contains(sentence));
        self.sentences.append(&mut other.sentences);
    }
}

/// Returns what to do with files of a kind; `advice` knows meshes or images.
fn advice_on(kind: FileKind, advice: fn(FileKind) -> Option<String>) -> Option<String> {
    let unpack = || UNPACK.to_owned();
    kind.is_archive().then(unpack).or_else(|| advice(kind))
}

/// Returns advice whose command is for all files with an extension such as `*.bmp`, with the extensions of these files as they
/// are written.
fn with_patterns(advice: &str, paths: &[&PathBuf]) -> String {
    let Some((before, _)) = advice.split_once("*.") else {
        return advice.to_owned();
    };
    let extensions = paths.iter().filter_map(|path| path.extension());
    let patterns: BTreeSet<String> = extensions
        .map(|extension| format!("*.{}", extension.display()))
        .collect();
    let patterns = Vec::from_iter(patterns);
    format!("{before}{}`", patterns.join(" "))
}

fn unread_kind(path: &Path) -> Option<FileKind> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let unread = || extension.and_then(FileKind::of_unread_extension);
    archive_kind(path).or_else(unread)
}

/// Returns the kind of an archive by its name.
pub(crate) fn archive_kind(path: &Path) -> Option<FileKind> {
    let extension = path.extension()?;
    let mut archives = ARCHIVES.into_iter();
    let archive = archives.find(|(name, _)| extension.eq_ignore_ascii_case(name));
    archive.map(|(_, kind)| kind)
}

/// The rows of a list with files in formats that are not read.
#[derive(Debug, Default)]
pub(crate) struct UnreadRows {
    meshes: BTreeSet<PathBuf>,
    prints: BTreeSet<PathBuf>,
    /// Whether a row has files that may be read.
    has_others: bool,
    with_one_file: OneFileRows,
}

impl UnreadRows {
    /// Looks at the paths of a row.
    pub(crate) fn add(&mut self, row: &ManifestRow) {
        let is_unread = |path: &Path, advice: fn(FileKind) -> Option<String>| {
            let kind = unread_kind(path);
            kind.and_then(|kind| advice_on(kind, advice)).is_some()
        };
        let mesh = is_unread(&row.mesh, FileKind::mesh_advice);
        let print = is_unread(&row.print, FileKind::image_advice);
        if mesh {
            self.meshes.insert(row.mesh.clone());
        }
        if print {
            self.prints.insert(row.print.clone());
        }
        self.has_others |= !mesh && !print;
        if row.mesh.as_os_str() == row.print.as_os_str() {
            self.with_one_file.count(row.line, row.name.as_str());
        }
    }

    /// Returns one warning per format, and one about rows with one file as mesh and print.
    ///
    /// # Errors
    /// Returns the sentences as an error if no row can be read.
    pub(crate) fn warnings(self) -> Result<Vec<String>, String> {
        let mut found = UnreadFiles::of(&self.meshes, "", FileKind::mesh_advice);
        found.append(UnreadFiles::of(&self.prints, "", FileKind::image_advice));
        if self.has_others || found.sentences.is_empty() {
            found.sentences.extend(self.with_one_file.warning());
            Ok(found.sentences)
        } else {
            Err(found.sentences.join("\n"))
        }
    }
}

/// Rows with one file as mesh and print.
#[derive(Debug, Default)]
pub(crate) struct OneFileRows {
    rows: usize,
    /// Id and line of the first.
    first: Option<(String, usize)>,
}

impl OneFileRows {
    /// Looks at a row whose paths differ, but may lead to one file, also through links.
    pub(crate) fn add(&mut self, line: usize, id: &str, files: &[FoundFile; 2]) {
        // Few rows have a mesh and a print of the same length, and only for these are links followed.
        let [mesh, print] = [0, 1].map(|at| files[at].meta.as_ref().map(Metadata::len));
        if mesh.is_none() || mesh != print {
            return;
        }
        let [mesh, print] = [0, 1].map(|at| files[at].place.canonicalize().ok());
        if mesh.is_some() && mesh == print {
            self.count(line, id);
        }
    }

    fn count(&mut self, line: usize, id: &str) {
        self.rows += 1;
        self.first.get_or_insert_with(|| (id.to_owned(), line));
    }

    pub(crate) fn warning(self) -> Option<String> {
        let count = self.rows;
        self.first.map(|(id, line)| {
            let id = quoted(&id);
            format!(
                "pairs with one file as mesh and print: {count}, the first {id} on line {line}; name a scan and an image"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::manifest_file::Listing;
    use crate::pair_choices::PairChoices;
    use mocban_lists::manifest::PairingChanges;

    #[test]
    fn files_that_are_not_read_get_one_sentence_per_format() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [meshes, prints] = ["meshes", "prints"].map(|name| dir.path().join(name));
        for folder in [&meshes, &prints] {
            std::fs::create_dir(folder).expect("a folder");
        }
        let write = |path: PathBuf| std::fs::write(path, "").expect("written");
        for name in ["a.bmp", "b.BMP", "c.bmp", "d.pdf", "notes.txt"] {
            write(prints.join(name));
        }
        for name in ["a.stl", "b.glb", "c.GLTF", "d.bmp", "e.ZIP"] {
            write(meshes.join(name));
        }
        let sentences = [
            format!(
                "ignored, a ZIP archive is not read: {}; unpack it, and import the files in it",
                meshes.join("e.ZIP").display()
            ),
            format!(
                "ignored, a glTF scene is not read: {} and 1 more; open them in MeshLab, Blender or CloudCompare and \
                 export them as PLY",
                meshes.join("b.glb").display()
            ),
            format!(
                "ignored, a BMP image is not read: {} and 2 more; open them in a program and save them as PNG; for many files, with ImageMagick: \
                 `magick mogrify -format png *.BMP *.bmp`",
                prints.join("a.bmp").display()
            ),
            format!(
                "ignored, a PDF document is not read: {}; open them in a program and save their pages as PNG; for many files: \
                 `pdftoppm -r 600 -png FILE.pdf page`",
                prints.join("d.pdf").display()
            ),
        ];
        let listed = || Listing::from_folders(&meshes, &prints, None, &PairingChanges::default());
        let refused = listed().expect("two folders").no_pair.expect("no pair");
        let refused = refused.to_string();
        for sentence in &sentences {
            assert_eq!(refused.matches(sentence).count(), 1, "{refused}");
        }
        write(prints.join("a.png"));
        let warnings = listed().expect("a pair").warnings;
        let other = format!(
            "neither mesh nor print: {}, {}",
            meshes.join("d.bmp").display(),
            prints.join("notes.txt").display()
        );
        assert_eq!(
            warnings,
            [&[format!("ignored, {other}")][..], &sentences].concat()
        );
    }

    #[test]
    fn a_file_that_is_mesh_and_print_is_named() {
        let list = b"id,mesh,print\na,a.stl,a.png\nb,b.stl,b.stl\nc,c.stl,c.stl\n".to_vec();
        let file = PathBuf::from("pairs.csv");
        let listing = Listing::from_bytes(&file, list, &PairChoices::default());
        let warning = "pairs with one file as mesh and print: 2, the first \"b\" on line 3; name a scan and an image";
        let warnings = listing.expect("a list").warnings;
        assert!(
            warnings.iter().any(|found| found == warning),
            "{warnings:?}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_mesh_and_print_is_named_under_other_paths() {
        use super::OneFileRows;
        use crate::input_paths::FoundFile;

        let dir = tempfile::tempdir().expect("a temporary directory");
        let place = |name: &str| dir.path().join(name);
        let found = |name: &str| {
            let meta = place(name).metadata().ok();
            FoundFile {
                place: place(name),
                meta,
            }
        };
        for (name, content) in [("a.stl", "mesh"), ("a.png", "png"), ("b.png", "mesh")] {
            std::fs::write(place(name), content).expect("written");
        }
        std::os::unix::fs::symlink("a.stl", place("link.png")).expect("a link");
        std::os::unix::fs::symlink(".", place("here")).expect("a link");
        let mut rows = OneFileRows::default();
        for (line, print) in
            (2..).zip(["a.png", "b.png", "./a.stl", "link.png", "here/a.stl", "no"])
        {
            rows.add(line, print, &[found("a.stl"), found(print)]);
        }
        assert_eq!(
            rows.warning().as_deref(),
            Some(
                "pairs with one file as mesh and print: 3, the first \"./a.stl\" on line 4; name a scan and an image"
            )
        );
    }
}

//! Says once per format, instead of once per file, that files of a folder are not read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use mocban_core::domain::FileKind;

/// Files in formats that are not read, by their names.
pub(crate) struct UnreadFiles {
    pub(crate) paths: BTreeSet<PathBuf>,
    /// One sentence per format.
    pub(crate) sentences: Vec<String>,
}

impl UnreadFiles {
    /// Finds the files of a folder whose format is not read and for which there is advice.
    pub(crate) fn of(folder: &[PathBuf], advice: fn(FileKind) -> Option<String>) -> Self {
        let mut formats: BTreeMap<&'static str, (FileKind, String, Vec<&PathBuf>)> =
            BTreeMap::new();
        for path in folder {
            let extension = path.extension().and_then(|extension| extension.to_str());
            let kind = extension.and_then(FileKind::of_unread_extension);
            if let Some((kind, advice)) = kind.and_then(|kind| Some((kind, advice(kind)?))) {
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
            let sentence = format!("ignored, {kind} is not read: {first}{more}; {advice}");
            found.sentences.push(sentence);
            found.paths.extend(paths.into_iter().cloned());
        }
        found
    }

    /// Adds the files of another folder.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.paths.append(&mut other.paths);
        self.sentences.append(&mut other.sentences);
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::manifest_file::Listing;

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
        for name in ["a.stl", "b.glb", "c.GLTF", "d.bmp"] {
            write(meshes.join(name));
        }
        let sentences = [
            format!(
                "ignored, a glTF scene is not read: {} and 1 more; open them in MeshLab, Blender or CloudCompare and \
                 export them as PLY",
                meshes.join("b.glb").display()
            ),
            format!(
                "ignored, a BMP image is not read: {} and 2 more; convert them, such as with ImageMagick: \
                 `magick mogrify -format png *.bmp`",
                prints.join("a.bmp").display()
            ),
            format!(
                "ignored, a PDF document is not read: {}; save their pages as images, such as with \
                 `pdftoppm -r 600 -png FILE.pdf page`",
                prints.join("d.pdf").display()
            ),
        ];
        let refused = Listing::from_folders(&meshes, &prints, None).expect_err("no pair");
        let refused = refused.to_string();
        for sentence in &sentences {
            assert_eq!(refused.matches(sentence).count(), 1, "{refused}");
        }
        write(prints.join("a.png"));
        let warnings = Listing::from_folders(&meshes, &prints, None)
            .expect("a pair")
            .warnings;
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
}

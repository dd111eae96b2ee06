//! What an import of pairs would store, without storing anything.

use std::path::PathBuf;

use crate::error::ProjectResult;
use crate::import_pairs::{PairSource, listing};
use crate::missing_files::MissingFiles;
use mocban_core::domain::PairName;
use mocban_store::Project;

/// A pair that would be imported.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedPair {
    /// Its id.
    pub name: PairName,
    /// Its scan.
    pub mesh: PathBuf,
    /// Its print.
    pub print: PathBuf,
    /// Its character, if the list names it.
    pub character: Option<String>,
    /// Its block, if the list names it.
    pub block: Option<String>,
    /// Messages about its files that do not exist.
    pub missing: Vec<String>,
}

/// What an import would do.
#[derive(Debug, Default)]
pub struct ImportPlan {
    /// Number of pairs.
    pub pairs: u64,
    /// The first pairs.
    pub first: Vec<PlannedPair>,
    /// Files that do not exist.
    pub missing: MissingFiles,
    /// Files without a partner, formats that cannot be read and names that look alike, one line each.
    pub warnings: Vec<String>,
    /// Which columns of the list were read under other names.
    pub renamed: Option<String>,
}

/// Reads a list or folders and looks at the files, as an import does before it stores the pairs. `shown` is the number of
/// pairs that are returned.
///
/// # Errors
/// Returns an error if an import would refuse the list or the folders.
pub fn plan_import(
    source: PairSource,
    project: &Project,
    shown: usize,
) -> ProjectResult<ImportPlan> {
    let mut listing = listing(source)?;
    let mut plan = ImportPlan {
        warnings: std::mem::take(&mut listing.warnings),
        renamed: listing.renamed.take(),
        ..ImportPlan::default()
    };
    listing.rows(project, |row, missing| {
        plan.pairs += 1;
        for line in &missing {
            plan.missing.add(line.clone());
        }
        if plan.first.len() < shown {
            plan.first.push(PlannedPair {
                name: row.name,
                mesh: row.mesh,
                print: row.print,
                character: row.character,
                block: row.block,
                missing,
            });
        }
    });
    Ok(plan)
}

#[cfg(test)]
mod tests {
    use super::plan_import;
    use crate::import_pairs::PairSource;
    use mocban_store::Project;

    #[test]
    fn a_plan_counts_pairs_and_stores_nothing() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let [meshes, prints] = ["stl", "print"].map(|name| dir.path().join(name));
        for (folder, names) in [
            (&meshes, &["1.stl", "2.stl", "alone.stl"][..]),
            (&prints, &["1.png", "2.png", "notes.txt"][..]),
        ] {
            std::fs::create_dir(folder).expect("a folder");
            for name in names {
                std::fs::write(folder.join(name), "x").expect("written");
            }
        }
        let project = Project::at(&dir.path().join("project"));
        let source = PairSource::Folders {
            meshes,
            prints,
            unit: None,
        };
        let plan = plan_import(source, &project, 1).expect("a plan");
        assert_eq!((plan.pairs, plan.first.len()), (2, 1));
        assert_eq!(plan.first[0].name.as_str(), "1");
        assert_eq!(plan.missing.count, 0);
        assert!(plan.warnings.iter().any(|line| line.contains("alone.stl")));
        assert!(!project.dir().exists(), "nothing is stored");
    }

    #[test]
    fn formats_of_a_list_that_are_not_read_get_one_sentence_each() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let project = Project::at(&dir.path().join("project"));
        let plan = |list: String| {
            let source = PairSource::List {
                file: dir.path().join("pairs.csv"),
                bytes: Some(list.into_bytes()),
            };
            plan_import(source, &project, 1)
        };
        let list = "id,mesh,print\n1,a.glb,a.png\n2,b.glb,b.bmp\n".to_owned();
        let sentences = [
            "a glTF scene is not read: a.glb and 1 more; ",
            "a BMP image is not read: b.bmp; ",
        ];
        let refused = plan(list.clone()).expect_err("nothing to read").to_string();
        for sentence in sentences {
            assert_eq!(refused.matches(sentence).count(), 1, "{refused}");
        }
        let mixed = plan(list + "3,c.ply,c.png\n").expect("one pair can be read");
        assert_eq!((mixed.pairs, mixed.warnings.len()), (3, 2));
        for (warning, sentence) in mixed.warnings.iter().zip(sentences) {
            assert!(warning.starts_with(sentence), "{warning}");
        }
    }
}

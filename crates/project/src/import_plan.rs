//! What an import of pairs would store, without storing anything.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use serde_json::Value;

use crate::column_hashes::{ColumnHasher, ColumnHashes};
use crate::error::ProjectResult;
use crate::import_pairs::{PairSource, listing};
use crate::location::Location;
use crate::manifest_file::ListedRows;
use crate::missing_files::MissingFiles;
use crate::pair_choices::PairChoices;
use mocban_core::domain::cancel::poll;
use mocban_core::domain::{ContentHash, LengthUnit, PairName};
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
    /// The unit of its scan, if it is given.
    pub unit: Option<LengthUnit>,
    /// Whether its block lay face down, if the list says so.
    pub scanned_face_down: Option<bool>,
    /// Hash of its other columns, as [`metadata_hash`] returns it.
    pub metadata: Option<ContentHash>,
    /// Hashes of its other columns by name. `None` if these columns are too many to be kept.
    pub columns: Option<ColumnHashes>,
    /// Messages about its files that do not exist.
    pub missing: Vec<String>,
}

/// What an import would do.
#[derive(Debug)]
pub struct ImportPlan {
    /// Number of pairs.
    pub pairs: u64,
    /// Hash of all pairs. An import of others can be refused.
    pub hash: ContentHash,
    /// The pairs that were asked for.
    pub shown: Vec<PlannedPair>,
    /// Whether the list or the folders name the block of a pair.
    pub has_blocks: bool,
    /// Meshes and prints of folders without a partner, by their paths below the folders.
    pub alone: [Vec<String>; 2],
    /// Says why folders have no pair.
    pub no_pair: Option<String>,
    /// Files that do not exist.
    pub missing: MissingFiles,
    /// Files without a partner, formats that cannot be read and names that look alike, one line each.
    pub warnings: Vec<String>,
    /// Which columns of the list were read under other names.
    pub renamed: Option<String>,
}

/// Returns a hash of columns, by which they are compared. `None` if there are none.
pub fn metadata_hash<'m>(
    columns: impl IntoIterator<Item = (&'m String, &'m Value)>,
) -> Option<ContentHash> {
    let sorted: BTreeMap<&String, &Value> = columns.into_iter().collect();
    // Values with names always have a JSON form.
    let text = serde_json::to_string(&sorted).unwrap_or_default();
    (!sorted.is_empty()).then(|| ContentHash::of(text.as_bytes()))
}

/// Reads a list or folders and looks at the files, as an import into a project does before it stores the pairs. Folders
/// may have no pair. `shown` has the positions of the pairs that are returned. Looking at the files polls for a cancellation.
///
/// # Errors
/// Returns an error if an import would refuse the list or the folders.
pub fn plan_import(
    source: PairSource,
    choices: &PairChoices,
    location: &Location,
    shown: &Range<u64>,
) -> ProjectResult<ImportPlan> {
    let (storage, _) = location.data_locations()?;
    let project = Project::at(&location.dir).with_storage(storage);
    let listing = listing(source, choices)?;
    let (mut pairs, mut planned, mut has_blocks) = (0, Vec::new(), false);
    let mut missing = MissingFiles::default();
    let mut columns = ColumnHasher::default();
    let ListedRows { hash, unusable } = listing.rows(&project, |mut row, lines| {
        poll();
        has_blocks |= row.block.is_some();
        choices.add_block(&mut row);
        for line in &lines {
            missing.add(line.clone());
        }
        if shown.contains(&pairs) {
            planned.push(PlannedPair {
                name: row.name,
                mesh: row.mesh,
                print: row.print,
                character: row.character,
                block: row.block,
                unit: row.unit,
                scanned_face_down: row.scanned_face_down,
                metadata: metadata_hash(&row.meta),
                columns: columns.hashes(&row.meta),
                missing: lines,
            });
        }
        pairs += 1;
    });
    if let Some(refused) = &listing.refused {
        return Err(missing.added_to(refused, false).into());
    }
    Ok(ImportPlan {
        pairs,
        hash,
        shown: planned,
        has_blocks,
        missing,
        alone: listing.alone,
        no_pair: listing.no_pair.map(|why| why.to_string()),
        warnings: listing.warnings.into_iter().chain(unusable).collect(),
        renamed: listing.renamed,
    })
}

#[cfg(test)]
mod tests {
    use super::plan_import;
    use crate::import_pairs::{AllowedChanges, PairImport, PairSource, import_pairs};
    use crate::location::Location;
    use crate::pair_choices::PairChoices;
    use mocban_lists::manifest::PairingChanges;

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
        let location = Location::new(dir.path().join("project"));
        let plan = |left_out: &[&str], shown| {
            let source = PairSource::Folders {
                meshes: meshes.clone(),
                prints: prints.clone(),
                unit: None,
            };
            let changes = PairingChanges {
                left_out: left_out.iter().map(|id| (*id).to_owned()).collect(),
                joined: Vec::new(),
            };
            let choices = PairChoices {
                changes,
                ..PairChoices::default()
            };
            plan_import(source, &choices, &location, &shown).expect("a plan")
        };
        let first = plan(&[], 0..1);
        assert_eq!((first.pairs, first.shown.len()), (2, 1));
        assert_eq!(first.shown[0].name.as_str(), "1");
        assert_eq!(first.missing.count, 0);
        assert!(first.warnings.iter().any(|line| line.contains("alone.stl")));
        assert_eq!(first.alone, [vec!["alone.stl".to_owned()], Vec::new()]);
        let second = plan(&[], 1..9);
        assert_eq!(
            (second.shown[0].name.as_str(), second.hash),
            ("2", first.hash)
        );
        let fewer = plan(&["1"], 0..9);
        assert_eq!(
            (fewer.pairs, fewer.alone[1].as_slice()),
            (1, &["1.png".to_owned()][..])
        );
        assert_ne!(fewer.hash, first.hash);
        let none = plan(&["1", "2"], 0..9);
        assert!(none.pairs == 0 && none.no_pair.is_some());
        assert!(!location.dir.exists(), "nothing is stored");
    }

    #[tokio::test]
    async fn only_the_pairs_that_were_shown_are_stored() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("pairs.csv");
        for name in ["a.stl", "a.png", "b.stl", "b.png"] {
            std::fs::write(dir.path().join(name), "x").expect("written");
        }
        let location = Location::new(dir.path().join("project"));
        let list = |text: &str| {
            std::fs::write(&file, text).expect("written");
            let file = file.clone();
            PairSource::List { file, bytes: None }
        };
        let rows = "id,mesh,print\na,a.stl,a.png\nb,b.stl,b.png\n";
        let mut choices = PairChoices::default();
        choices.changes.left_out = vec!["b".to_owned()];
        let plan = plan_import(list(rows), &choices, &location, &(0..9)).expect("a plan");
        assert_eq!(plan.pairs, 1);
        choices.shown = Some(plan.hash);
        let import = async |source, choices: &PairChoices| {
            let import = PairImport {
                source,
                truth: None,
                allowed: AllowedChanges::default(),
                choices: choices.clone(),
            };
            let outcome = import_pairs(import, &location, &()).await;
            outcome
                .map(|outcome| outcome.summary.added)
                .map_err(|error| error.to_string())
        };
        let other = "id,mesh,print\na,b.stl,a.png\nb,b.stl,b.png\n";
        let refused = import(list(other), &choices).await.expect_err("changed");
        assert!(
            refused.contains("changed after the pairs were shown"),
            "{refused}"
        );
        assert!(!location.dir.exists(), "nothing is stored");
        assert_eq!(import(list(rows), &choices).await, Ok(1));
        choices.changes.left_out.push("c".to_owned());
        let refused = import(list(rows), &choices)
            .await
            .expect_err("no such pair");
        assert!(refused.contains("there is no pair \"c\""), "{refused}");
    }

    #[tokio::test]
    async fn a_block_is_chosen_for_the_pairs_that_have_none() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        for name in ["a.stl", "a.png", "b.stl", "b.png"] {
            std::fs::write(dir.path().join(name), "x").expect("written");
        }
        let location = Location::new(dir.path().join("project"));
        let list = |text: &str| PairSource::List {
            file: dir.path().join("pairs.csv"),
            bytes: Some(text.as_bytes().to_vec()),
        };
        let rows = "id,mesh,print,block\na,a.stl,a.png,\nb,b.stl,b.png,Ván 2\n";
        let mut choices = PairChoices {
            block: Some("Ván 1".to_owned()),
            ..PairChoices::default()
        };
        let plan = plan_import(list(rows), &choices, &location, &(0..9)).expect("a plan");
        let blocks: Vec<Option<&str>> = plan
            .shown
            .iter()
            .map(|pair| pair.block.as_deref())
            .collect();
        assert_eq!(blocks, [Some("Ván 1"), Some("Ván 2")]);
        assert!(plan.has_blocks);
        let without = "id,mesh,print\na,a.stl,a.png\nb,b.stl,b.png\n";
        let plan = plan_import(list(without), &choices, &location, &(0..9)).expect("a plan");
        assert!(!plan.has_blocks, "the list has none");
        // Like the unit of folders, the block is typed below the pairs that are shown.
        choices.shown = Some(plan.hash);
        choices.block = Some("Ván 3".to_owned());
        let import = |source, choices| PairImport {
            source,
            truth: None,
            allowed: AllowedChanges::default(),
            choices,
        };
        let imported = import_pairs(import(list(without), choices.clone()), &location, &()).await;
        assert_eq!(imported.expect("imported").summary.added, 2);
        let folders = PairSource::Folders {
            meshes: dir.path().to_owned(),
            prints: dir.path().to_owned(),
            unit: None,
        };
        let other = PairChoices {
            block: Some("Ván 4".to_owned()),
            ..PairChoices::default()
        };
        let again = import_pairs(import(folders, other), &location, &()).await;
        let again = again.expect("imported").summary;
        assert_eq!((again.added, again.unchanged), (0, 2), "they keep theirs");
    }

    #[test]
    fn formats_of_a_list_that_are_not_read_get_one_sentence_each() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let location = Location::new(dir.path().join("project"));
        let plan = |list: String| {
            let source = PairSource::List {
                file: dir.path().join("pairs.csv"),
                bytes: Some(list.into_bytes()),
            };
            plan_import(source, &PairChoices::default(), &location, &(0..1))
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

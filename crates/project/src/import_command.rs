//! The command that imports the files of a pair or block again from their new place.

use std::fmt;
use std::path::Path;

use mocban_catalog::{BlockAttributes, PairAttributes};
use mocban_core::domain::spelling::fold_case;

/// An import in the way in which pairs or blocks were likely imported before.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ImportCommand {
    /// Of a list.
    #[default]
    List,
    /// Of two folders.
    Folders {
        /// Whether the pair has a unit, which an import without it would remove.
        has_unit: bool,
    },
    /// Of one block. An import without what it has would remove it.
    Block {
        /// Whether it has labels.
        has_labels: bool,
        /// Whether its id is not the name of its mesh.
        has_name: bool,
        /// Whether it has a side.
        has_side: bool,
        /// Whether it has a unit.
        has_unit: bool,
    },
}

impl ImportCommand {
    /// Returns the import that fits a pair: folders give files of one name, which is that of the pair, and no columns.
    pub(crate) fn of_pair(pair: &PairAttributes) -> Self {
        let (mesh, print) = (stem(&pair.mesh_path), stem(&pair.print_path));
        let id = pair.name.folded();
        let is_paired = mesh == print && (id == mesh || id.ends_with(&format!("_{mesh}")));
        if is_paired && !pair.has_more_than_folders_give() {
            Self::Folders {
                has_unit: pair.unit.is_some(),
            }
        } else {
            Self::List
        }
    }

    /// Returns the import that fits a block with its metadata: only lists give some.
    pub(crate) fn of_block(block: &BlockAttributes) -> Self {
        if block.meta.as_ref().is_some_and(|meta| !meta.is_empty()) {
            return Self::List;
        }
        Self::Block {
            has_labels: block.labels_path.is_some(),
            has_name: fold_case(block.name.as_str()) != stem(&block.mesh_path),
            has_side: block.side.is_some(),
            has_unit: block.unit.is_some(),
        }
    }
}

/// Returns the name of a file without folders and extension, in lower case.
fn stem(path: &str) -> String {
    let path = path.replace('\\', "/");
    let stem = Path::new(&path).file_stem();
    fold_case(&stem.unwrap_or_default().to_string_lossy())
}

impl fmt::Display for ImportCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (files, options) = match *self {
            Self::List => ("LIST", Vec::new()),
            Self::Folders { has_unit } => (
                "--meshes DIR --prints DIR",
                vec![(has_unit, " --unit UNIT")],
            ),
            Self::Block {
                has_labels,
                has_name,
                has_side,
                has_unit,
            } => {
                let options = vec![
                    (has_labels, " --labels FILE"),
                    (has_name, " --name ID"),
                    (has_side, " --side SIDE"),
                    (has_unit, " --unit UNIT"),
                ];
                ("--block MESH --page IMAGE", options)
            }
        };
        let options = options.into_iter().filter(|(is_given, _)| *is_given);
        let options: String = options.map(|(_, option)| option).collect();
        write!(f, "import {files}{options} --allow-changed-files")
    }
}

#[cfg(test)]
mod tests {
    use super::ImportCommand;
    use mocban_catalog::{BlockAttributes, PairAttributes};
    use mocban_core::domain::{BlockName, BlockSide, LengthUnit, PairName};
    use serde_json::{Map, json};

    #[test]
    fn the_command_fits_how_files_were_imported() {
        let pair = |id: &str, files: [&str; 2]| PairAttributes {
            name: PairName::new(id).expect("an id"),
            mesh_path: files[0].to_owned(),
            print_path: files[1].to_owned(),
            unit: None,
            scanned_face_down: None,
            character: None,
            block: None,
            meta: Map::new(),
            prior: None,
        };
        let folders = pair("b4_A1", ["stl/b4/a1.stl", r"D:\print\b4\A1.png"]);
        let mut of_folder = folders.clone();
        of_folder.block = Some("b4".to_owned());
        let mut of_list = folders.clone();
        of_list.block = Some("Ván 4".to_owned());
        let mut with_column = folders.clone();
        with_column.meta.insert("folio".to_owned(), json!("3a"));
        let mut with_unit = folders.clone();
        with_unit.unit = Some(LengthUnit::Cm);
        let other = pair("b4_A1", ["stl/1.stl", "print/1.png"]);
        let mut of_short_block = pair("b4-1", ["stl/b4-1.stl", "print/b4-1.png"]);
        of_short_block.block = Some("b4".to_owned());
        for (pair, expected) in [
            (folders, ImportCommand::Folders { has_unit: false }),
            (of_folder, ImportCommand::Folders { has_unit: false }),
            (with_unit, ImportCommand::Folders { has_unit: true }),
            (of_list, ImportCommand::List),
            (with_column, ImportCommand::List),
            (other, ImportCommand::List),
            (of_short_block, ImportCommand::List),
        ] {
            assert_eq!(ImportCommand::of_pair(&pair), expected, "{pair:?}");
        }
        let mut block = BlockAttributes {
            name: BlockName::new("b4").expect("an id"),
            mesh_path: "b4.stl".to_owned(),
            page_path: "b4.png".to_owned(),
            labels_path: None,
            unit: None,
            side: None,
            meta: Some(Map::new()),
        };
        assert_eq!(
            ImportCommand::of_block(&block).to_string(),
            "import --block MESH --page IMAGE --allow-changed-files"
        );
        block.labels_path = Some("b4.json".to_owned());
        assert_eq!(
            ImportCommand::of_block(&block).to_string(),
            "import --block MESH --page IMAGE --labels FILE --allow-changed-files"
        );
        block.name = BlockName::new("tale 4").expect("an id");
        (block.side, block.unit) = (Some(BlockSide::Front), Some(LengthUnit::Cm));
        assert_eq!(
            ImportCommand::of_block(&block).to_string(),
            "import --block MESH --page IMAGE --labels FILE --name ID --side SIDE --unit UNIT --allow-changed-files"
        );
        block.meta = json!({"shelfmark": "R.4"}).as_object().cloned();
        assert_eq!(ImportCommand::of_block(&block), ImportCommand::List);
    }
}

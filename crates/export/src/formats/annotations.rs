//! The format `annotations`: strokes and characters as COCO and VIA files.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::single_results::{NamedFiles, SingleResults};
use crate::annotations::{CocoCategories, CocoText, StrokeAnnotation, ViaRegions};
use crate::export_folder::{FolderError, SharedFile};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::page_labels::PAGE_FILES;
use crate::pair_pictures::{PairPictures, PictureError};
use crate::record::{PairRecord, SplitName};

/// The file of boxes.
const VIA: &str = "via.json";
/// Description of the dataset in COCO files.
const DESCRIPTION: &str = "Strokes of carved blocks, aligned with their prints";

const USAGE: &str = "\
## Use

The mask of an annotation covers all strokes of one character: the stroke tops of the scan at `threshold_depth`, moved
onto the print. A category is a character, or `stroke` if the manifest names none. Several pairs on one page share its
image. Ids count from 1 in the order of the pairs. `bbox` and the boxes in `via.json` are the bounds of the mask:
a box [x, y, width, height] begins at the corner of its first pixel. Masks are run-length encoded with compressed
counts, which `pycocotools` and all tools built on it read. `pair` names the pair, and `attributes` holds block,
verdict, confidence and more; `pairs.jsonl` holds its complete record. Pairs without a result have a line there, but no
annotation.

`pages` has the images that whole blocks were printed as, each with the boxes of all its characters, also of those that
were not cut. Open `pages/BLOCK.json` as a project in VIA 2 to correct them, and give the corrected file to `import --block`
as `--labels`.

`via.json` opens in VIA 2 (Annotation > Import Annotations from JSON) after the images were added.

```python
from pycocotools.coco import COCO
coco = COCO(\"coco.json\")                                      # with --split: coco_train.json and so on
mask = coco.annToMask(coco.loadAnns(coco.getAnnIds())[0])     # 1 on strokes
```
";

/// What a pair adds to shared files.
#[derive(Debug, Serialize, Deserialize)]
struct PairAnnotation {
    strokes: StrokeAnnotation,
    /// Size of the print file in bytes.
    print_bytes: u64,
}

/// A COCO file that is being written.
struct CocoFile {
    text: CocoText,
    file: SharedFile,
}

impl CocoFile {
    fn begin(folder: &FormatFolder, split: Option<SplitName>) -> Result<Self, FolderError> {
        let mut file = SharedFile::create(&folder.root, &coco_name(split))?;
        file.append(CocoText::head(DESCRIPTION).as_bytes())?;
        let text = CocoText::default();
        Ok(Self { text, file })
    }
}

/// Writes the annotation files and the prints.
pub(super) struct AnnotationWriter {
    folder: FormatFolder,
    results: SingleResults,
    categories: CocoCategories,
    files: BTreeMap<Option<SplitName>, CocoFile>,
    regions: ViaRegions,
}

impl AnnotationWriter {
    pub(super) fn begin(folder: FormatFolder) -> Result<Self, FolderError> {
        let splits = match folder.context.options.split {
            None => vec![None],
            Some(_) => [SplitName::Train, SplitName::Validation, SplitName::Test]
                .map(Some)
                .to_vec(),
        };
        let mut files = BTreeMap::new();
        for split in splits {
            files.insert(split, CocoFile::begin(&folder, split)?);
        }
        Ok(Self {
            results: SingleResults::begin(&folder)?,
            folder,
            categories: CocoCategories::default(),
            files,
            regions: ViaRegions::default(),
        })
    }

    /// Adds the print to the files of a pair. Returns its path below the folder, and its size in bytes.
    fn add_print(
        &self,
        record: &PairRecord,
        pictures: &PairPictures<'_>,
        encoded: &mut EncodedPair,
    ) -> Result<(String, u64), PictureError> {
        let (bytes, extension) = pictures.original_file()?;
        let size = bytes.len() as u64;
        let pair = &record.pair;
        match self.folder.context.shared_prints.get(&pair.print) {
            // All pairs of a page write the same bytes, so the first of them that is encoded may do it.
            Some(first) if *first != pair.id => {
                let path = format!("images/{}.{extension}", first.file_name());
                if !self.folder.root.join(&path).exists() {
                    encoded.add_file(&path, bytes);
                }
                Ok((path, size))
            }
            _ => {
                encoded.add_file(format!("images/*.{extension}"), bytes);
                Ok((format!("images/{}.{extension}", pair.id.file_name()), size))
            }
        }
    }
}

impl FormatWriter for AnnotationWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let Some(shown) = SingleResults::of_pair(view) else {
            return Ok(self.results.without_result(view));
        };
        let (fields, pictures) = (shown.fields, shown.pictures);
        let mut encoded = EncodedPair::default();
        let pair = &view.record.pair;
        let mask = pictures.mask_on_print(&shown.record.outcome)?;
        let (file_name, print_bytes) = self.add_print(view.record, pictures, &mut encoded)?;
        let attributes = json!({
            "block": pair.block,
            "metric": fields.metric,
            "confidence": fields.confidence,
            "verdict": fields.verdict,
            "split": pair.split,
        });
        let files = NamedFiles::from([("print", file_name.clone())]);
        let annotation = PairAnnotation {
            strokes: StrokeAnnotation::new(
                pair.id.clone(),
                pair.character.clone(),
                file_name,
                mask,
                attributes,
            ),
            print_bytes,
        };
        encoded
            .shared
            .push(self.results.line(view, Some((fields, files))));
        let text =
            serde_json::to_vec(&annotation).expect("annotations hold only texts and numbers");
        encoded.shared.push(text);
        Ok(encoded)
    }

    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        let [line, annotation @ ..] = &shared[..] else {
            return Ok(());
        };
        self.results.append(line)?;
        for text in annotation {
            let added: PairAnnotation = serde_json::from_slice(text).expect("written above");
            self.regions.add(&added.strokes, added.print_bytes);
            let CocoFile { text, file } = match self.files.entry(record.pair.split) {
                Entry::Occupied(found) => found.into_mut(),
                // A pair that was imported during the export belongs to no part of a split.
                Entry::Vacant(place) => place.insert(CocoFile::begin(&self.folder, None)?),
            };
            let text = text.annotation(&added.strokes, &mut self.categories);
            file.append(text.as_bytes())?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        let mut names = vec![self.results.finish()?, VIA.to_owned()];
        for (split, CocoFile { text, file }) in &mut self.files {
            file.append(text.tail(&self.categories).as_bytes())?;
            file.flush()?;
            names.push(coco_name(*split));
        }
        let mut via = SharedFile::create(&self.folder.root, VIA)?;
        std::mem::take(&mut self.regions).write(|text| via.append(text.as_bytes()))?;
        via.flush()?;
        Ok(names)
    }

    fn guide(&self) -> FormatGuide {
        let names: Vec<String> = self.files.keys().map(|split| coco_name(*split)).collect();
        let mut files: Vec<[&str; 2]> = names
            .iter()
            .map(|name| [name.as_str(), "COCO: masks, boxes and areas of the strokes"])
            .collect();
        files.push([
            VIA,
            "VIA 2: the box of each character, with its id and text",
        ]);
        files.push([
            "images/ID.EXT",
            "the prints, upright; a page has the id of the first of its pairs",
        ]);
        files.extend(PAGE_FILES);
        let purpose = "Strokes of carved blocks as annotations of their prints.";
        self.results.guide(purpose, &files, USAGE)
    }
}

/// Returns the name of the COCO file of a part of the dataset, or of the whole.
fn coco_name(split: Option<SplitName>) -> String {
    split.map_or("coco.json".to_owned(), |split| {
        format!("coco_{}.json", split.name())
    })
}

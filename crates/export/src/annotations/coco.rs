//! COCO annotation files: masks and boxes of the strokes of each pair.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::rle::{compressed, run_lengths};
use mocban_core::domain::PairName;
use mocban_core::raster::Mask;

/// Category of pairs whose character is unknown.
const STROKE: &str = "stroke";

/// A print image that annotations refer to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct CocoImage {
    /// Number of the image, from 1.
    id: u32,
    /// Path of the image below the export folder.
    file_name: String,
    width: usize,
    height: usize,
}

/// The strokes of a pair on its print.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct StrokeAnnotation {
    /// The pair.
    pub(crate) pair: PairName,
    /// The character, if known.
    pub(crate) character: Option<String>,
    /// Path of the print below the export folder.
    pub(crate) file_name: String,
    /// Width and height of the print in pixels.
    size: [usize; 2],
    /// Left, top, width and height of the strokes in pixels; zeros if there are none.
    pub(super) bbox: [usize; 4],
    /// Pixels of the strokes.
    pub(super) area: usize,
    /// The mask in COCO's compressed run-length encoding.
    counts: String,
    /// Further fields of the annotation.
    attributes: Value,
}

impl StrokeAnnotation {
    /// Measures and encodes the stroke mask of a pair, which has the frame and size of the print.
    pub(crate) fn new(
        pair: PairName,
        character: Option<String>,
        file_name: String,
        mask: &Mask,
        attributes: Value,
    ) -> Self {
        let bounds = mask.bounding_box();
        Self {
            pair,
            character,
            file_name,
            size: [mask.width(), mask.height()],
            bbox: bounds.map_or([0; 4], |b| [b.x0, b.y0, b.width(), b.height()]),
            area: mask.count(),
            counts: compressed(&run_lengths(mask)),
            attributes,
        }
    }
}

/// The categories of all files of an export: one per character, numbered from 1 in the order of their first pairs.
#[derive(Debug, Default)]
pub(crate) struct CocoCategories(BTreeMap<String, u32>);

impl CocoCategories {
    /// Returns the number of a pair's category.
    fn number(&mut self, strokes: &StrokeAnnotation) -> u32 {
        let name = strokes.character.as_deref().unwrap_or(STROKE).to_owned();
        let next = self.0.len() as u32 + 1;
        *self.0.entry(name).or_insert(next)
    }

    /// Returns the list that each file holds.
    fn list(&self) -> Vec<Value> {
        let mut all: Vec<(&String, &u32)> = self.0.iter().collect();
        all.sort_unstable_by_key(|(_, id)| **id);
        let category = |(name, id)| json!({"id": id, "name": name, "supercategory": "character"});
        all.into_iter().map(category).collect()
    }
}

/// The text of a COCO file, annotation by annotation. Only the list of images is kept in memory.
///
/// Ids count from 1 in the order of the annotations. The lists of images and categories come last in the file.
#[derive(Debug, Default)]
pub(crate) struct CocoText {
    images: BTreeMap<String, CocoImage>,
    annotations: u32,
}

impl CocoText {
    /// Returns the beginning of a file with the given description of the dataset.
    pub(crate) fn head(description: &str) -> String {
        let info = json!({"description": description, "version": env!("CARGO_PKG_VERSION")});
        format!("{{\"info\":{info},\"licenses\":[],\"annotations\":[")
    }

    /// Returns the text of the next annotation. Annotations with the same file name share an image.
    pub(crate) fn annotation(
        &mut self,
        strokes: &StrokeAnnotation,
        categories: &mut CocoCategories,
    ) -> String {
        let next_image = self.images.len() as u32 + 1;
        let [width, height] = strokes.size;
        let image = self.images.entry(strokes.file_name.clone());
        let image = image.or_insert_with(|| CocoImage {
            id: next_image,
            file_name: strokes.file_name.clone(),
            width,
            height,
        });
        self.annotations += 1;
        let annotation = json!({
            "id": self.annotations,
            "image_id": image.id,
            "category_id": categories.number(strokes),
            "iscrowd": 0,
            "area": strokes.area,
            "bbox": strokes.bbox,
            "segmentation": {"size": [height, width], "counts": strokes.counts},
            "pair": strokes.pair,
            "attributes": strokes.attributes,
        });
        let comma = if self.annotations > 1 { "," } else { "" };
        format!("{comma}\n{annotation}")
    }

    /// Returns the end of the file.
    pub(crate) fn tail(&self, categories: &CocoCategories) -> String {
        let mut images: Vec<&CocoImage> = self.images.values().collect();
        images.sort_unstable_by_key(|image| image.id);
        let (images, categories) = (json!(images), json!(categories.list()));
        format!("\n],\"images\":{images},\"categories\":{categories}}}\n")
    }
}

#[cfg(test)]
pub(super) mod tests {
    use serde_json::{Value, json};

    use super::{CocoCategories, CocoText, StrokeAnnotation};
    use mocban_core::raster::Mask;

    /// Returns the annotation of a square of four pixels on a print of 9 x 7 pixels.
    pub(crate) fn square(pair: &str, character: Option<&str>, file_name: &str) -> StrokeAnnotation {
        let mask = Mask::from_fn(9, 7, |x, y| (3..5).contains(&x) && (1..3).contains(&y));
        let name = pair.parse().expect("a valid name");
        let character = character.map(str::to_owned);
        StrokeAnnotation::new(
            name,
            character,
            file_name.to_owned(),
            &mask,
            json!({"c": 1}),
        )
    }

    fn written(all: &[StrokeAnnotation]) -> Value {
        let (mut file, mut categories) = (CocoText::default(), CocoCategories::default());
        let mut text = CocoText::head("prints");
        for strokes in all {
            text += &file.annotation(strokes, &mut categories);
        }
        text += &file.tail(&categories);
        serde_json::from_str(&text).expect("JSON")
    }

    #[test]
    fn pairs_of_one_page_share_its_image() {
        let file = written(&[
            square("a", Some("\u{4eba}"), "images/p1.png"),
            square("b", None, "images/p2.png"),
            square("c", Some("\u{4eba}"), "images/p1.png"),
        ]);
        let of = |field: &str| {
            let all = file["annotations"].as_array().expect("a list").iter();
            all.map(|one| one[field].clone()).collect::<Vec<_>>()
        };
        assert_eq!(of("id"), [1, 2, 3]);
        assert_eq!(of("image_id"), [1, 2, 1]);
        assert_eq!(of("category_id"), [1, 2, 1]);
        assert_eq!(of("pair"), ["a", "b", "c"]);
        let images = json!([
            {"id": 1, "file_name": "images/p1.png", "width": 9, "height": 7},
            {"id": 2, "file_name": "images/p2.png", "width": 9, "height": 7},
        ]);
        assert_eq!(file["images"], images);
        let names = file["categories"].as_array().expect("a list").iter();
        let names: Vec<&Value> = names.map(|category| &category["name"]).collect();
        assert_eq!(names, ["\u{4eba}", "stroke"]);
    }

    #[test]
    fn box_area_and_size_are_those_of_the_mask() {
        let file = written(&[square("a", None, "images/p1.png")]);
        let one = &file["annotations"][0];
        assert_eq!(one["bbox"], json!([3, 1, 2, 2]));
        assert_eq!(one["area"], 4);
        assert_eq!(one["segmentation"]["size"], json!([7, 9]));
        assert_eq!(one["attributes"]["c"], 1);
    }

    #[test]
    fn a_file_without_annotations_is_valid() {
        let file = written(&[]);
        assert_eq!(file["annotations"], json!([]));
        assert_eq!(file["images"], json!([]));
    }
}

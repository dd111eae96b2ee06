//! Annotation files of the VGG Image Annotator 2: the box of each character on its print.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::coco::StrokeAnnotation;

/// A print with the boxes on it.
#[derive(Debug)]
struct ViaImage {
    /// Size of the file in bytes.
    bytes: u64,
    regions: Vec<Value>,
}

/// Collects the boxes of characters by print. VIA lists all boxes of an image in one place.
#[derive(Debug, Default)]
pub(crate) struct ViaRegions(BTreeMap<String, ViaImage>);

impl ViaRegions {
    /// Adds the box of a pair on a print file of `bytes` bytes. A pair without strokes has no box.
    pub(crate) fn add(&mut self, strokes: &StrokeAnnotation, bytes: u64) {
        // VIA names an image by its file name without folders.
        let name = strokes.file_name.rsplit('/').next().unwrap_or_default();
        let image = self.0.entry(name.to_owned()).or_insert_with(|| ViaImage {
            bytes,
            regions: Vec::new(),
        });
        let [x, y, width, height] = strokes.bbox;
        if strokes.area > 0 {
            image.regions.push(json!({
                "shape_attributes": {"name": "rect", "x": x, "y": y, "width": width, "height": height},
                "region_attributes": {
                    "id": strokes.pair,
                    "character": strokes.character.as_deref().unwrap_or_default(),
                },
            }));
        }
    }

    /// Writes the file, image by image. The key of an image is its name followed by its size in bytes, as in VIA.
    pub(crate) fn write<E>(self, mut append: impl FnMut(&str) -> Result<(), E>) -> Result<(), E> {
        append("{")?;
        for (k, (name, image)) in self.0.into_iter().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            let key = json!(format!("{name}{}", image.bytes));
            let value = json!({
                "filename": name,
                "size": image.bytes,
                "regions": image.regions,
                "file_attributes": {},
            });
            append(&format!("{comma}\n{key}:{value}"))?;
        }
        append("\n}\n")
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use serde_json::{Value, json};

    use super::ViaRegions;
    use crate::annotations::coco::tests::square;

    fn written(regions: ViaRegions) -> Value {
        let mut text = String::new();
        let added = regions.write(|part| -> Result<(), Infallible> {
            text += part;
            Ok(())
        });
        added.expect("a String takes any text");
        serde_json::from_str(&text).expect("JSON")
    }

    #[test]
    fn boxes_of_a_page_are_listed_together() {
        let mut regions = ViaRegions::default();
        for (pair, print, bytes) in [
            ("a", "images/p1.png", 10),
            ("b", "images/p2.png", 20),
            ("c", "images/p1.png", 10),
        ] {
            regions.add(&square(pair, Some("\u{4eba}"), print), bytes);
        }
        let file = written(regions);
        let page = &file["p1.png10"];
        assert_eq!(
            [&page["filename"], &page["size"]],
            [&json!("p1.png"), &json!(10)]
        );
        let ids = page["regions"].as_array().expect("a list").iter();
        let ids: Vec<&Value> = ids
            .map(|region| &region["region_attributes"]["id"])
            .collect();
        assert_eq!(ids, ["a", "c"]);
        let expected = json!({"name": "rect", "x": 3, "y": 1, "width": 2, "height": 2});
        assert_eq!(page["regions"][0]["shape_attributes"], expected);
        assert_eq!(
            file["p2.png20"]["regions"][0]["region_attributes"]["character"],
            "\u{4eba}"
        );
    }

    #[test]
    fn a_file_without_images_is_valid() {
        assert_eq!(written(ViaRegions::default()), json!({}));
    }
}

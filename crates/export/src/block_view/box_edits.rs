//! What a person changes in the boxes of a page.

use serde::Deserialize;

use mocban_lists::labels::{self, LabelBox, PageFile, ReplacedLabels};

/// Name of the boxes in the messages of the reader of labels.
const NAME: &str = "the boxes";
/// What the reader of labels says it did with wrong boxes. Of edited labels nothing is stored instead.
const DONE_BY_READER: [&str; 4] = [
    " and was left out",
    " and were left out",
    " and was cut there",
    " and were cut there",
];

/// Changes of the boxes that a page has shown. Boxes that are not named stay as they are shown, with their outlines.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxEdits {
    /// Which of the shown boxes are gone.
    removed: Vec<usize>,
    /// Boxes that are new or changed.
    edited: Vec<EditedBox>,
}

/// A box that is new or changed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct EditedBox {
    /// Which of the shown boxes it was; `None` for a new one.
    was: Option<usize>,
    name: Option<String>,
    text: Option<String>,
    /// Left, top, right and bottom in pixels of the page; `None` if the outline stays.
    bounds: Option<[f64; 4]>,
}

/// Why changes of boxes cannot be stored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoxEditError {
    /// No box is left.
    #[error("no box is left: keep at least one, or retire the pairs of the block")]
    NoneLeft,
    /// The changes name a box that was not shown, or one twice.
    #[error("box {number} was not shown: reload the page")]
    NotShown {
        /// Which one, from 1.
        number: usize,
    },
    /// A box has no outline.
    #[error("a new box has no edges")]
    NoEdges,
    /// An import would refuse the boxes, or leave some out.
    #[error("{0}")]
    Refused(String),
}

impl BoxEdits {
    /// Returns the boxes that were shown with the changes.
    fn applied_to(&self, shown: &[LabelBox]) -> Result<Vec<LabelBox>, BoxEditError> {
        let not_shown = |index: usize| BoxEditError::NotShown {
            number: index.saturating_add(1),
        };
        let mut kept: Vec<Option<LabelBox>> = shown.iter().cloned().map(Some).collect();
        for &index in &self.removed {
            let removed = kept.get_mut(index).and_then(Option::take);
            removed.ok_or_else(|| not_shown(index))?;
        }
        let mut added = Vec::new();
        for edit in &self.edited {
            let (name, text) = (filled(edit.name.as_deref()), filled(edit.text.as_deref()));
            let outline = edit
                .bounds
                .map(|bounds| LabelBox::rectangle(bounds).outline);
            if let Some(index) = edit.was {
                let known = kept.get_mut(index).and_then(Option::as_mut);
                let label = known.ok_or_else(|| not_shown(index))?;
                (label.name, label.text) = (name, text);
                if let Some(outline) = outline {
                    label.outline = outline;
                }
            } else {
                let outline = outline.ok_or(BoxEditError::NoEdges)?;
                added.push(LabelBox {
                    name,
                    text,
                    outline,
                });
            }
        }
        let boxes: Vec<LabelBox> = kept.into_iter().flatten().chain(added).collect();
        if boxes.is_empty() {
            return Err(BoxEditError::NoneLeft);
        }
        Ok(boxes)
    }

    /// Returns the labels of a page with the changes, as a file that names the labels it replaces; `None` if nothing changes.
    /// They are checked as those of an import are, and nothing is left out of them.
    pub(super) fn labels_file(
        &self,
        shown: &[LabelBox],
        page: &PageFile<'_>,
        replaced: &ReplacedLabels,
    ) -> Result<Option<Vec<u8>>, BoxEditError> {
        let boxes = self.applied_to(shown)?;
        if boxes == shown {
            return Ok(None);
        }
        let bytes = labels::write_edited(&boxes, page, replaced);
        let read = labels::read(&bytes, NAME, page);
        let read = read.map_err(|error| BoxEditError::Refused(error.to_string()))?;
        match read.warnings.into_iter().next() {
            Some(warning) => {
                let problem = DONE_BY_READER
                    .iter()
                    .fold(warning, |text, end| text.replace(end, ""));
                let text = format!("{problem}; nothing was saved");
                Err(BoxEditError::Refused(text))
            }
            None => Ok(Some(bytes)),
        }
    }
}

/// Returns a text that was typed, without blanks at its ends; `None` if nothing is left.
fn filled(text: Option<&str>) -> Option<String> {
    let text = text?.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{BoxEditError, BoxEdits, NAME};
    use mocban_lists::labels::{self, LabelBox, PageFile, ReplacedLabels};

    const PAGE: PageFile<'static> = PageFile {
        name: "pages/b1.jpg",
        bytes: 12_345,
        width: 200,
        height: 100,
    };

    /// Two boxes, the second of which is a polygon.
    fn shown() -> Vec<LabelBox> {
        let named = |name: &str, bounds| LabelBox {
            name: Some(name.to_owned()),
            ..LabelBox::rectangle(bounds)
        };
        let mut boxes = vec![
            named("a", [9.5, 9.5, 29.5, 29.5]),
            named("b", [49.5, 9.5, 69.5, 29.5]),
        ];
        boxes[1].outline[2] = [65.5, 27.5];
        boxes
    }

    fn stored(edits: &Value) -> Result<Option<Vec<LabelBox>>, BoxEditError> {
        let edits: BoxEdits = serde_json::from_value(edits.clone()).expect("edits");
        let path = Some("few.json".to_owned());
        let file = edits.labels_file(&shown(), &PAGE, &ReplacedLabels { path })?;
        Ok(file.map(|bytes| {
            let read = labels::read(&bytes, NAME, &PAGE).expect("valid labels");
            assert_eq!(read.warnings, [""; 0]);
            read.boxes
        }))
    }

    #[test]
    fn boxes_that_are_not_changed_keep_their_outlines() {
        let edits = json!({"removed": [0], "edited": [
            {"was": 1, "name": " b2 ", "text": "明"},
            {"name": "", "bounds": [99.5, 9.5, 119.5, 29.5]},
        ]});
        let boxes = stored(&edits).expect("valid").expect("changed");
        let names: Vec<Option<&str>> = boxes.iter().map(|one| one.name.as_deref()).collect();
        assert_eq!(names, [Some("b2"), None]);
        assert_eq!(boxes[0].outline, shown()[1].outline);
        assert_eq!(boxes[0].text.as_deref(), Some("明"));
        assert_eq!(boxes[1].bounds(), [99.5, 9.5, 119.5, 29.5]);
        let edits = json!({"removed": [], "edited": [
            {"was": 1, "name": "b", "bounds": [50.5, 9.5, 70.5, 29.5]},
        ]});
        let boxes = stored(&edits).expect("valid").expect("changed");
        assert!(boxes[1].is_rectangle());
        assert_eq!(boxes[1].bounds(), [50.5, 9.5, 70.5, 29.5]);
    }

    #[test]
    fn the_same_boxes_are_no_change() {
        for edited in [json!([]), json!([{"was": 0, "name": "a"}])] {
            let edits = json!({"removed": [], "edited": edited});
            assert_eq!(stored(&edits), Ok(None), "{edits}");
        }
    }

    #[test]
    fn boxes_that_an_import_refuses_or_leaves_out_are_refused() {
        for (edits, expected) in [
            (json!({"removed": [0, 1], "edited": []}), "no box is left"),
            (json!({"removed": [2], "edited": []}), "box 3 was not shown"),
            (
                json!({"removed": [0, 0], "edited": []}),
                "box 1 was not shown",
            ),
            (
                json!({"removed": [0], "edited": [{"was": 0}]}),
                "box 1 was not shown",
            ),
            (
                json!({"removed": [], "edited": [{}]}),
                "a new box has no edges",
            ),
            (
                json!({"removed": [], "edited": [{"was": 1, "name": "A"}]}),
                "the boxes: box 1 and box 2 are both named",
            ),
            (
                json!({"removed": [], "edited": [{"bounds": [9.5, 9.5, 29.5, 29.5]}]}),
                "the boxes: 1 box repeats another: box 3 as box 1",
            ),
            (
                json!({"removed": [], "edited": [{"bounds": [9.5, 9.5, 9.6, 29.5]}]}),
                "the boxes: 1 box is smaller than a pixel, a point or a line: box 3; nothing was saved",
            ),
            (
                json!({"removed": [], "edited": [{"bounds": [300.0, 9.5, 320.0, 29.5]}]}),
                "the boxes: 1 of 3 boxes lies outside the page: box 3; nothing was saved",
            ),
            (
                json!({"removed": [], "edited": [{"bounds": [9.5, 9.5, 1e300, 29.5]}]}),
                "the boxes: box 3: ",
            ),
        ] {
            let refused = stored(&edits).expect_err("refused").to_string();
            assert!(refused.starts_with(expected), "{edits}: {refused}");
        }
    }
}

//! Boxes of a page, and the page they belong to.

use mocban_core::domain::enum_names;

/// Format of a file with labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LabelFormat {
    /// JSON of the VGG Image Annotator 2: annotations, or a whole project.
    Via2,
    /// JSON of the VGG Image Annotator 1, in which the regions of an image are an object.
    Via1,
    /// CSV of the VGG Image Annotator 1 or 2.
    ViaCsv,
    /// `{"bboxes": [{"x_min": 0, "y_min": 0, "x_max": 1, "y_max": 1}]}`.
    Bboxes,
    /// COCO with boxes or polygons.
    Coco,
    /// JSON of labelme.
    Labelme,
    /// YOLO text: one box or polygon per line, as fractions of the page.
    Yolo,
    /// PAGE-XML, the format of transcription tools.
    PageXml,
}

enum_names! { pub LabelFormat, "a format of labels":
    Via2 = "VIA 2",
    Via1 = "VIA 1",
    ViaCsv = "VIA CSV",
    Bboxes = "bboxes",
    Coco = "COCO",
    Labelme = "labelme",
    Yolo = "YOLO",
    PageXml = "PAGE-XML",
}

/// The image of the page that labels belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageFile<'a> {
    /// File name; folders before it are ignored.
    pub name: &'a str,
    /// Size of the file in bytes.
    pub bytes: u64,
    /// Width of the upright image in pixels.
    pub width: u32,
    /// Height of the upright image in pixels.
    pub height: u32,
}

/// The outline of one character on a page.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelBox {
    /// Name from the file, a valid id of a pair, unique on the page.
    pub name: Option<String>,
    /// The character, or a longer transcription.
    pub text: Option<String>,
    /// Corners in pixels of the page in order, at least three; (0, 0) is the centre of the top-left pixel. A rectangle
    /// starts at its top-left corner and continues at the top right.
    pub outline: Vec<[f64; 2]>,
}

impl LabelBox {
    /// Creates a rectangle without name and text from left, top, right and bottom in pixels of the page.
    pub fn rectangle(bounds: [f64; 4]) -> Self {
        Self {
            name: None,
            text: None,
            outline: rectangle(bounds),
        }
    }

    /// Returns left, top, right and bottom of the outline, in pixels of the page.
    pub fn bounds(&self) -> [f64; 4] {
        bounds(&self.outline)
    }

    /// Returns whether the outline is an upright rectangle.
    pub fn is_rectangle(&self) -> bool {
        self.outline == rectangle(self.bounds())
    }
}

/// The labels of one page.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    /// Format of the file.
    pub format: LabelFormat,
    /// Boxes in the order of the file. At least one.
    pub boxes: Vec<LabelBox>,
    /// What was assumed or left out, one sentence each, beginning with the name of the file.
    pub warnings: Vec<String>,
}

/// Returns the corners of a rectangle clockwise on the page from the top left. Takes left, top, right and bottom.
pub(super) fn rectangle([x0, y0, x1, y1]: [f64; 4]) -> Vec<[f64; 2]> {
    vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// Returns left, top, right and bottom of points.
pub(super) fn bounds(points: &[[f64; 2]]) -> [f64; 4] {
    let start = [
        f64::INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NEG_INFINITY,
    ];
    points.iter().fold(start, |[x0, y0, x1, y1], [x, y]| {
        [x0.min(*x), y0.min(*y), x1.max(*x), y1.max(*y)]
    })
}

//! Errors of the reader of labels.

use super::message::{boxes, for_count, list, quoted};
use mocban_core::domain::{ONLY_ZEROS, pointer_of, sanitize};

/// Maximum number of characters of a reason, which may quote the file.
const MAX_REASON: usize = 300;

/// Why labels could not be read. The message begins with the name of the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}: {problem}", sanitize(.file, 4096))]
pub struct LabelsError {
    /// Name of the file with the labels.
    pub file: String,
    /// What is wrong with it.
    pub problem: LabelsProblem,
}

/// What is wrong with a file of labels, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LabelsProblem {
    /// The file has no bytes.
    #[error("the file is empty (0 bytes); save the labels again")]
    Empty,
    /// The file is larger than any labels.
    #[error("the file has {bytes} bytes; labels of at most {limit} bytes are read")]
    TooLarge {
        /// Size of the file.
        bytes: u64,
        /// Largest size.
        limit: u64,
    },
    /// All bytes of the file are zero.
    #[error("the file {ONLY_ZEROS}")]
    OnlyZeros,
    /// The file is a pointer of Git LFS.
    #[error("the file {}", pointer_of("labels"))]
    Pointer,
    /// The file is not text in UTF-8.
    #[error("the file is {0}; labels are {FORMATS}, in UTF-8")]
    NotText(String),
    /// Text of an unknown format.
    #[error("the text begins with {}, as no known format does; labels are {FORMATS}", quoted(.0))]
    UnknownText(String),
    /// JSON of an unknown structure.
    #[error("JSON with {0} is not a known format; labels are {FORMATS}")]
    UnknownJson(String),
    /// A project of VIA 3.
    #[error(
        "this is a project of VIA 3, which is not read; draw the boxes in VIA 2, or export COCO"
    )]
    Via3,
    /// XML with an unknown root element.
    #[error("the root element of the XML is {}, not \"PcGts\"; of XML, only PAGE-XML is read", quoted(.0))]
    UnknownXml(String),
    /// The syntax is not valid.
    #[error("the {format} is damaged: {}; save the labels again", sanitize(.reason, MAX_REASON))]
    Damaged {
        /// JSON, XML, CSV or YOLO.
        format: &'static str,
        /// What was found, and where.
        reason: String,
    },
    /// The content ends early.
    #[error("the {format} is truncated: it ends early at line {line}; save or copy the file again")]
    Truncated {
        /// JSON, XML or CSV.
        format: &'static str,
        /// Last line, from 1.
        line: usize,
    },
    /// A part of the file is not what the format demands.
    #[error("{place}: {}; correct or remove it", sanitize(.reason, MAX_REASON))]
    Malformed {
        /// The part, such as `box 3`.
        place: String,
        /// What was seen.
        reason: String,
    },
    /// There is no box.
    #[error("the file has no boxes{}; draw at least one", of_page(.0.as_deref()))]
    NoBoxes(Option<String>),
    /// The page has no box, but this number of boxes are of no image.
    #[error(
        "the file has no boxes of this page, and the image_id of others is that of no image (boxes: {0}); write the id of their image there"
    )]
    OfNoImage(usize),
    /// All boxes have numbers from 0 to 1 where the format has pixels.
    #[error(
        "all numbers of its boxes are from 0 to 1: they look like fractions of the page, and this format has pixels; multiply them by width and height of the page"
    )]
    Fractions,
    /// More boxes than a page can have.
    #[error("the page has more than {limit} boxes; keep only the boxes of its characters")]
    TooManyBoxes {
        /// Largest number.
        limit: usize,
    },
    /// An outline with more corners than a character can have.
    #[error("{place}: the outline has more than {limit} corners; simplify it or draw a box")]
    TooManyCorners {
        /// The part, such as `box 3`.
        place: String,
        /// Largest number.
        limit: usize,
    },
    /// More values than fit the memory for labels.
    #[error("reading the JSON would take more than {} MiB of memory; save fewer pages in one file", .limit >> 20)]
    TooManyValues {
        /// Largest size of the values in bytes.
        limit: usize,
    },
    /// The boxes overlap more often than characters can.
    #[error(
        "the boxes together are {times:.0} times as large as the page, more than {limit} times; keep only the boxes of its characters"
    )]
    Overlap {
        /// Area of all boxes as a multiple of the area of the page.
        times: f64,
        /// Largest multiple.
        limit: f64,
    },
    /// The file holds several pages, but not this one.
    #[error("no labels for {}: the file is about {}; take the labels of this page, or rename it", quoted(.page), list(.pages))]
    OtherPages {
        /// File name of the page.
        page: String,
        /// Pages in the file, in quotation marks.
        pages: Vec<String>,
    },
    /// Several pages in the file match equally well.
    #[error("{} entries of the file are about {}; keep one of them", .0, quoted(.1))]
    AmbiguousPage(usize, String),
    /// The labels were made on an image of another shape.
    #[error("the labels are for an image of {} x {} px, the page is {} x {} px{}; take the image that was labelled",
        .labels[0], .labels[1], .page[0], .page[1], turned(*.labels, *.page))]
    OtherSize {
        /// Width and height that the file names.
        labels: [f64; 2],
        /// Width and height of the page.
        page: [u32; 2],
    },
    /// Most boxes lie outside the page.
    #[error("{outside} of {} {} outside the page of {} x {} px: {}?", boxes(*.count),
        for_count(*.outside, "lies", "lie"), .page[0], .page[1], likely_fault(*.are_corners))]
    Outside {
        /// Boxes outside.
        outside: usize,
        /// All boxes.
        count: usize,
        /// Width and height of the page.
        page: [u32; 2],
        /// Whether all boxes lie on the page if their numbers are two corners.
        are_corners: bool,
    },
    /// Two boxes have the same name.
    #[error("box {first} and box {second} are both named {} (upper and lower case are equal); rename one of them", quoted(.name))]
    SameName {
        /// The name.
        name: String,
        /// Number of the first box.
        first: usize,
        /// Number of the other box.
        second: usize,
    },
}

/// The formats, as errors list them.
const FORMATS: &str =
    "VIA (JSON or CSV), COCO, labelme, YOLO, PAGE-XML or {\"bboxes\": [{\"x_min\": ...}]}";

impl LabelsProblem {
    /// Adds the name of the file.
    pub(super) fn in_file(self, file: &str) -> LabelsError {
        LabelsError {
            file: file.to_owned(),
            problem: self,
        }
    }

    /// Returns a problem of a part of the file.
    pub(super) fn at(place: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Malformed {
            place: place.into(),
            reason: reason.into(),
        }
    }
}

fn of_page(page: Option<&str>) -> String {
    page.map_or_else(String::new, |page| format!(" for {}", quoted(page)))
}

/// Returns a hint if the sizes are equal after a quarter turn.
fn turned([width, height]: [f64; 2], page: [u32; 2]) -> &'static str {
    let equal = width == f64::from(page[1]) && height == f64::from(page[0]);
    if equal {
        " (the labelled image was turned, perhaps by its EXIF orientation)"
    } else {
        ""
    }
}

/// Returns the likely reason why most boxes lie outside the page.
const fn likely_fault(are_corners: bool) -> &'static str {
    if are_corners {
        "as two corners, their numbers fit the page; are they corners where this format has width and height"
    } else {
        "labels of another page"
    }
}

//! PAGE-XML: regions, lines, words and glyphs of one page.

use quick_xml::events::BytesStart;

use super::page_levels::{LEVELS, PageElement, characters};
use crate::labels::error::LabelsProblem;
use crate::labels::message::{line_at, quoted};
use crate::labels::page_fit::{MAX_CORNERS, check_count};
use crate::labels::region::{Corners, LabelRegion, PageRegions, checked, filled, polygon};
use crate::xml::{self, XmlFault, XmlPart, local_name, read_xml};
use mocban_core::domain::cancel::polled;

/// An element that is open, and what it holds so far.
#[derive(Debug, Default)]
struct OpenElement {
    name: String,
    id: Option<String>,
    corners: Option<Corners>,
    /// Alternative text: the first or the one with the smallest index.
    text: Option<(u32, String)>,
    /// Index of a `TextEquiv`. Of a `Unicode`: 1 once its text was taken.
    index: u32,
    /// Whether an element inside it may stand for a character and has an outline.
    is_divided: bool,
}

/// Regions of a page while its file is read.
#[derive(Debug, Default)]
struct PageParser {
    open: Vec<OpenElement>,
    /// The elements that are not divided further.
    found: Vec<PageElement>,
    page: Option<PageRegions>,
}

/// Reads the smallest elements of a page: glyphs, words that are not divided into glyphs, and so on. See [`characters`].
pub(in crate::labels) fn read(text: &str) -> Result<PageRegions, LabelsProblem> {
    let mut parser = PageParser::default();
    let read = read_xml(text, |part| match part {
        XmlPart::Start(element) => parser.start(&element),
        XmlPart::End => parser.end(),
        XmlPart::Text(part) => {
            parser.text(&part);
            Ok(())
        }
    });
    read.map_err(|fault| match fault {
        XmlFault::Truncated => truncated(text),
        XmlFault::Damaged(at, reason)
        | XmlFault::Refused(at, LabelsProblem::Damaged { reason, .. }) => {
            damaged(text, at, &reason)
        }
        XmlFault::Refused(_, problem) => problem,
    })?;
    let no_page = || LabelsProblem::at("the element PcGts", "it has no element Page");
    let mut page = parser.page.ok_or_else(no_page)?;
    (page.regions, page.warnings) = characters(parser.found);
    Ok(page)
}

fn truncated(text: &str) -> LabelsProblem {
    LabelsProblem::Truncated {
        format: "XML",
        line: text.lines().count(),
    }
}

fn damaged(text: &str, at: usize, reason: &str) -> LabelsProblem {
    let line = line_at(text, at);
    LabelsProblem::Damaged {
        format: "XML",
        reason: format!("{reason} at line {line}"),
    }
}

/// Returns the value of an attribute.
fn attribute(element: &BytesStart<'_>, key: &str) -> Result<Option<String>, LabelsProblem> {
    xml::attribute(element, key).map_err(|reason| LabelsProblem::Damaged {
        format: "XML",
        reason,
    })
}

impl PageParser {
    fn start(&mut self, element: &BytesStart<'_>) -> Result<(), LabelsProblem> {
        let name = local_name(element);
        if self.open.is_empty() && name != "PcGts" {
            return Err(LabelsProblem::UnknownXml(name));
        }
        match name.as_str() {
            "Page" => self.start_page(element)?,
            "Coords" => {
                if let Some(points) = attribute(element, "points")? {
                    let corners = self.points(&points)?;
                    self.set_corners(corners);
                }
            }
            // Before 2013, each point was an element.
            "Point" => {
                let (x, y) = (attribute(element, "x")?, attribute(element, "y")?);
                let point = format!("{},{}", x.unwrap_or_default(), y.unwrap_or_default());
                let corners = self.points(&point)?;
                self.add_corners(corners)?;
            }
            _ => {}
        }
        let index = match name.as_str() {
            "TextEquiv" => attribute(element, "index")?,
            _ => None,
        };
        self.open.push(OpenElement {
            id: attribute(element, "id")?.as_deref().and_then(filled),
            index: index.and_then(|index| index.parse().ok()).unwrap_or(0),
            name,
            ..OpenElement::default()
        });
        Ok(())
    }

    fn start_page(&mut self, element: &BytesStart<'_>) -> Result<(), LabelsProblem> {
        if self.page.is_some() {
            let problem = LabelsProblem::at("the element PcGts", "it has several elements Page");
            return Err(problem);
        }
        let side = |key| -> Result<Option<f64>, LabelsProblem> {
            let side = attribute(element, key)?.and_then(|side| side.trim().parse::<f64>().ok());
            Ok(side.filter(|side| side.is_finite() && *side >= 1.0))
        };
        let size = side("imageWidth")?.zip(side("imageHeight")?);
        self.page = Some(PageRegions {
            file_name: attribute(element, "imageFilename")?,
            size: size.map(|(width, height)| [width, height]),
            ..PageRegions::default()
        });
        Ok(())
    }

    /// Reads `x,y x,y`.
    fn points(&self, text: &str) -> Result<Corners, LabelsProblem> {
        let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.is_finite());
        let point = |word: &str| {
            let (x, y) = word.split_once(',')?;
            Some([number(x)?, number(y)?])
        };
        let point = |word: &str| {
            let [x, y] = point(word).ok_or_else(|| format!("{} is not a point", quoted(word)))?;
            Ok([checked(x, "x")?, checked(y, "y")?])
        };
        let words = polled(text.split_whitespace()).take(MAX_CORNERS + 1);
        let points = words.map(point).collect::<Result<Corners, String>>();
        if points
            .as_ref()
            .is_ok_and(|points| points.len() > MAX_CORNERS)
        {
            return Err(self.too_many_corners());
        }
        points.map_err(|reason| LabelsProblem::at(self.place(), reason))
    }

    fn too_many_corners(&self) -> LabelsProblem {
        let (place, limit) = (self.place(), MAX_CORNERS);
        LabelsProblem::TooManyCorners { place, limit }
    }

    /// Returns the innermost open element that has an id, for a message.
    fn place(&self) -> String {
        let named = self
            .open
            .iter()
            .rev()
            .find_map(|element| Some((&element.name, element.id.as_ref()?)));
        named.map_or_else(
            || "the coordinates".to_owned(),
            |(name, id)| format!("the coordinates of {name} {}", quoted(id)),
        )
    }

    /// Sets the corners of the element around `Coords`.
    fn set_corners(&mut self, corners: Corners) {
        if let Some(element) = self.open.last_mut() {
            element.corners = Some(corners);
        }
    }

    /// Adds corners to the element around the open `Coords`; points of other elements, such as baselines, are ignored.
    fn add_corners(&mut self, corners: Corners) -> Result<(), LabelsProblem> {
        let mut count = 0;
        if let [.., element, coords] = self.open.as_mut_slice()
            && coords.name == "Coords"
        {
            let all = element.corners.get_or_insert_default();
            all.extend(corners);
            count = all.len();
        }
        if count > MAX_CORNERS {
            return Err(self.too_many_corners());
        }
        Ok(())
    }

    /// Adds a part of the text inside `Unicode`, which is inside `TextEquiv` inside the element that it belongs to.
    fn text(&mut self, part: &str) {
        if let [.., element, equivalent, unicode] = self.open.as_mut_slice()
            && unicode.name == "Unicode"
            && equivalent.name == "TextEquiv"
        {
            let index = equivalent.index;
            match &mut element.text {
                // The same element `Unicode` goes on.
                Some((_, text)) if unicode.index == 1 => text.push_str(part),
                Some((best, _)) if *best <= index => {}
                text => {
                    *text = Some((index, part.to_owned()));
                    unicode.index = 1;
                }
            }
        }
    }

    fn end(&mut self) -> Result<(), LabelsProblem> {
        let Some(element) = self.open.pop() else {
            return Ok(());
        };
        if let Some(level) = LEVELS.iter().position(|level| **level == element.name) {
            let corners = element.corners.and_then(polygon);
            if element.is_divided {
                return Ok(());
            }
            for around in self.open.iter_mut().filter(|_| corners.is_some()) {
                around.is_divided = true;
            }
            let number = self.found.len() + 1;
            check_count(number)?;
            let region = LabelRegion {
                number,
                name: element.id,
                text: element.text.as_ref().and_then(|(_, text)| filled(text)),
                corners,
            };
            self.found.push(PageElement { level, region });
        }
        Ok(())
    }
}

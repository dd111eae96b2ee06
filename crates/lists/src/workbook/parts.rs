//! Parts of a workbook beside its sheets: names of sheets, shared strings, and formats of numbers.

use std::collections::HashMap;

use quick_xml::events::BytesStart;

use super::archive::{WorkbookArchive, damaged};
use super::error::WorkbookError;
use super::number_format::NumberFormat;
use super::shown_number::ShownNumber;
use super::shown_text::ShownText;
use crate::xml::{XmlFault, XmlPart, attribute, local_name, read_xml};

/// The file that names the sheets, and the folder of the others.
const WORKBOOK: &str = "xl/workbook.xml";
const RELATIONS: &str = "xl/_rels/workbook.xml.rels";
const FOLDER: &str = "xl/";

/// Maximum numbers of shared strings (fewer in tests), of styles, and of sheets and other files. Excel has at most 65,490
/// styles.
const MAX_STRINGS: usize = if cfg!(test) { 1000 } else { 4 << 20 };
const MAX_STYLES: usize = 100_000;
const MAX_SHEETS: usize = 10_000;

/// Refuses a workbook that has more of something than any has.
fn check_count(count: usize, limit: usize, what: &str) -> Result<(), WorkbookError> {
    if count <= limit {
        return Ok(());
    }
    Err(damaged(&format!("it has more than {limit} {what}")))
}

/// Returns an attribute of an element, or an empty text.
pub(super) fn value(element: &BytesStart<'_>, key: &str) -> Result<String, WorkbookError> {
    let value = attribute(element, key).map_err(|reason| damaged(&reason))?;
    Ok(value.unwrap_or_default())
}

/// Calls `each` for every part of a file.
pub(super) fn read_part(
    file: &str,
    text: &str,
    each: impl FnMut(XmlPart<'_>) -> Result<(), WorkbookError>,
) -> Result<(), WorkbookError> {
    read_xml(text, each).map_err(|fault| match fault {
        XmlFault::Truncated => damaged(&format!("{file} ends early")),
        XmlFault::Damaged(_, reason) => damaged(&format!("{file}: {reason}")),
        XmlFault::Refused(_, error) => error,
    })
}

/// A sheet of a workbook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct WorkbookSheet {
    pub(super) name: String,
    pub(super) is_hidden: bool,
    /// Its file.
    pub(super) file: String,
}

/// What the sheets of a workbook share.
#[derive(Debug, Default)]
pub(super) struct Workbook {
    pub(super) sheets: Vec<WorkbookSheet>,
    pub(super) strings: Vec<String>,
    /// Format of numbers of each style.
    pub(super) formats: Vec<NumberFormat>,
    /// How styles show the numbers of ids, if not as numbers.
    pub(super) shown_numbers: HashMap<usize, ShownNumber>,
    /// How styles show the texts of ids, if not as they are.
    pub(super) shown_texts: HashMap<usize, ShownText>,
    /// Whether days are counted from 1904.
    pub(super) is_1904: bool,
}

impl Workbook {
    /// Reads all parts but the sheets.
    pub(super) fn read(archive: &WorkbookArchive<'_>) -> Result<Self, WorkbookError> {
        let Some(text) = archive.text(WORKBOOK)? else {
            return Err(WorkbookError::OtherArchive(other_kind(archive)));
        };
        let relations = Relations::read(&archive.text(RELATIONS)?.unwrap_or_default())?;
        let mut workbook = Self::default();
        read_part(WORKBOOK, &text, |part| {
            let XmlPart::Start(element) = part else {
                return Ok(());
            };
            match local_name(&element).as_str() {
                "workbookPr" => {
                    let is_1904 = value(&element, "date1904")?;
                    workbook.is_1904 = matches!(is_1904.as_str(), "1" | "true");
                }
                "sheet" => workbook.sheets.push(WorkbookSheet {
                    name: value(&element, "name")?,
                    is_hidden: !matches!(value(&element, "state")?.as_str(), "" | "visible"),
                    file: relations.file(&value(&element, "r:id")?),
                }),
                _ => {}
            }
            check_count(workbook.sheets.len(), MAX_SHEETS, "sheets")
        })?;
        if let Some(file) = &relations.strings
            && let Some(text) = archive.text(file)?
        {
            workbook.strings = strings(file, &text)?;
        }
        if let Some(file) = &relations.styles
            && let Some(text) = archive.text(file)?
        {
            workbook.read_formats(file, &text)?;
        }
        Ok(workbook)
    }
}

/// Returns what an archive without a workbook of Excel is.
fn other_kind(archive: &WorkbookArchive<'_>) -> &'static str {
    if archive.has("xl/workbook.bin") {
        "a binary workbook (XLSB)"
    } else if archive.has("content.xml") {
        "a sheet or text of OpenDocument"
    } else if archive.has("word/document.xml") {
        "a text document"
    } else {
        "an archive"
    }
}

/// Files of a workbook by the ids that it gives them.
#[derive(Default)]
struct Relations {
    files: HashMap<String, String>,
    strings: Option<String>,
    styles: Option<String>,
}

impl Relations {
    fn read(text: &str) -> Result<Self, WorkbookError> {
        let mut relations = Self::default();
        read_part(RELATIONS, text, |part| {
            if let XmlPart::Start(element) = part
                && local_name(&element) == "Relationship"
            {
                let target = value(&element, "Target")?;
                // A path from the root of the archive, or from the folder of the workbook.
                let file = match target.strip_prefix('/') {
                    Some(path) => path.to_owned(),
                    None => format!("{FOLDER}{target}"),
                };
                let kind = value(&element, "Type")?;
                match kind.rsplit('/').next() {
                    Some("sharedStrings") => relations.strings = Some(file.clone()),
                    Some("styles") => relations.styles = Some(file.clone()),
                    _ => {}
                }
                relations.files.insert(value(&element, "Id")?, file);
            }
            check_count(relations.files.len(), MAX_SHEETS, "files")
        })?;
        Ok(relations)
    }

    fn file(&self, id: &str) -> String {
        self.files.get(id).cloned().unwrap_or_default()
    }
}

/// Reads shared strings. The parts of a string with several formats are joined; readings of characters are left out.
fn strings(file: &str, text: &str) -> Result<Vec<String>, WorkbookError> {
    let mut strings = Vec::new();
    let mut collector = TextCollector::default();
    read_part(file, text, |part| {
        match &part {
            XmlPart::Start(element) if local_name(element) == "si" => strings.push(String::new()),
            _ => {}
        }
        if let (Some(text), Some(string)) = (collector.add(&part), strings.last_mut()) {
            string.push_str(text);
        }
        check_count(strings.len(), MAX_STRINGS, "shared strings")
    })?;
    Ok(strings)
}

/// Follows which element is open, for the texts of cells and strings.
#[derive(Debug, Default)]
pub(super) struct TextCollector {
    open: Vec<String>,
}

impl TextCollector {
    /// Adds a part. Returns it if it is text of an element `t` that is not a reading (`rPh`).
    pub(super) fn add<'p>(&mut self, part: &'p XmlPart<'_>) -> Option<&'p str> {
        match part {
            XmlPart::Start(element) => self.open.push(local_name(element)),
            XmlPart::End => {
                self.open.pop();
            }
            XmlPart::Text(text) => {
                let is_text = self.is_in("t") && !self.open.iter().any(|name| name == "rPh");
                return is_text.then_some(text);
            }
        }
        None
    }

    /// Returns whether an element is the innermost open one.
    pub(super) fn is_in(&self, name: &str) -> bool {
        self.open.last().is_some_and(|open| open == name)
    }
}

/// What a code does to the values of cells.
#[derive(Clone)]
struct CellFormat {
    number: NumberFormat,
    /// How numbers of ids are shown, if not as numbers.
    shown: Option<ShownNumber>,
    /// How texts of ids are shown, if not as they are.
    text: Option<ShownText>,
}

impl CellFormat {
    fn of_code(code: &str) -> Self {
        let number = NumberFormat::of_code(code);
        let is_plain = number == NumberFormat::Plain;
        Self {
            number,
            shown: is_plain.then(|| ShownNumber::of_code(code)).flatten(),
            text: ShownText::of_code(code),
        }
    }
}

impl Workbook {
    /// Reads the format of numbers of each style of cells.
    fn read_formats(&mut self, file: &str, text: &str) -> Result<(), WorkbookError> {
        let mut codes: HashMap<u32, CellFormat> = HashMap::new();
        let mut in_cells = false;
        let mut open = Vec::new();
        read_part(file, text, |part| {
            match part {
                XmlPart::Start(element) => {
                    let name = local_name(&element);
                    let id = |key| Ok(value(&element, key)?.parse::<u32>().unwrap_or_default());
                    match name.as_str() {
                        "numFmt" => {
                            let code = value(&element, "formatCode")?;
                            codes.insert(id("numFmtId")?, CellFormat::of_code(&code));
                        }
                        "cellXfs" => in_cells = true,
                        "xf" if in_cells => {
                            let id = id("numFmtId")?;
                            let style = self.formats.len();
                            let format = codes.get(&id);
                            let number = format.map(|format| format.number);
                            if let Some(CellFormat { shown, text, .. }) = format.cloned() {
                                self.shown_numbers.extend(shown.map(|shown| (style, shown)));
                                self.shown_texts.extend(text.map(|text| (style, text)));
                            }
                            let number = number.unwrap_or_else(|| NumberFormat::built_in(id));
                            self.formats.push(number);
                        }
                        _ => {}
                    }
                    open.push(name);
                }
                XmlPart::End => {
                    if open.pop().is_some_and(|name| name == "cellXfs") {
                        in_cells = false;
                    }
                }
                XmlPart::Text(_) => {}
            }
            check_count(self.formats.len().max(codes.len()), MAX_STYLES, "styles")
        })
    }
}

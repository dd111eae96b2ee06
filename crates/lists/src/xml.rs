//! Elements and texts of XML, for the readers of labels and workbooks.

use std::borrow::Cow;

use quick_xml::XmlVersion;
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesRef, BytesStart, Event};
use quick_xml::reader::Reader;

use mocban_core::domain::cancel::PollCounter;
use mocban_core::domain::sanitize;

/// Deepest nesting of elements.
const MAX_DEPTH: usize = 64;
/// Longest name of an entity in a message, in characters.
const MAX_NAME_CHARS: usize = 60;

/// A part of XML.
pub(crate) enum XmlPart<'x> {
    /// An element begins. An empty element also ends.
    Start(BytesStart<'x>),
    /// An element ends.
    End,
    /// A part of a text; references are resolved.
    Text(Cow<'x, str>),
}

/// Why XML cannot be read.
pub(crate) enum XmlFault<E> {
    /// The text ends early.
    Truncated,
    /// The syntax is damaged before this byte.
    Damaged(usize, String),
    /// The reader of the parts refused one, which ends at this byte.
    Refused(usize, E),
}

/// Calls `each` for every part of a text.
///
/// # Errors
/// Returns an error if the text is damaged or truncated, elements are nested too deeply, or `each` refuses a part.
pub(crate) fn read_xml<E>(
    text: &str,
    mut each: impl FnMut(XmlPart<'_>) -> Result<(), E>,
) -> Result<(), XmlFault<E>> {
    let mut reader = Reader::from_str(text);
    let mut counter = PollCounter::default();
    let mut depth = 0_usize;
    loop {
        counter.tick();
        let event = reader.read_event();
        let at = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX);
        let damaged = |reason: String| XmlFault::Damaged(at, reason);
        let event = event.map_err(|error| match error {
            // Errors of syntax are parts without end.
            quick_xml::Error::Syntax(_) => XmlFault::Truncated,
            error => damaged(error.to_string()),
        })?;
        let mut part = |part| each(part).map_err(|error| XmlFault::Refused(at, error));
        match event {
            Event::Start(_) if depth == MAX_DEPTH => {
                let reason = format!("more than {MAX_DEPTH} elements are nested");
                return Err(damaged(reason));
            }
            Event::Start(element) => {
                depth += 1;
                part(XmlPart::Start(element))?;
            }
            Event::Empty(element) => {
                part(XmlPart::Start(element))?;
                part(XmlPart::End)?;
            }
            Event::End(_) if depth == 0 => {
                return Err(damaged("an element ends that did not begin".to_owned()));
            }
            Event::End(_) => {
                depth -= 1;
                part(XmlPart::End)?;
            }
            Event::Text(text) => {
                let text = text.decode().map_err(|error| damaged(error.to_string()))?;
                part(XmlPart::Text(text))?;
            }
            Event::CData(text) => {
                let text = text.decode().map_err(|error| damaged(error.to_string()))?;
                part(XmlPart::Text(text))?;
            }
            Event::GeneralRef(reference) => {
                let text = resolved(&reference).map_err(damaged)?;
                part(XmlPart::Text(text.into()))?;
            }
            Event::Eof if depth > 0 => return Err(XmlFault::Truncated),
            Event::Eof => return Ok(()),
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
    }
}

/// Returns the character that a reference such as `&amp;` or `&#22825;` stands for.
fn resolved(reference: &BytesRef<'_>) -> Result<String, String> {
    let code = reference.resolve_char_ref();
    if let Some(code) = code.map_err(|error| error.to_string())? {
        return Ok(code.to_string());
    }
    let name = reference.decode().map_err(|error| error.to_string())?;
    let text = resolve_predefined_entity(&name).map(str::to_owned);
    let unknown = || {
        format!(
            "the entity \"{}\" is unknown",
            sanitize(&name, MAX_NAME_CHARS)
        )
    };
    text.ok_or_else(unknown)
}

/// Returns the name of an element without its prefix.
pub(crate) fn local_name(element: &BytesStart<'_>) -> String {
    String::from_utf8_lossy(element.local_name().as_ref()).into_owned()
}

/// Returns the value of an attribute.
///
/// # Errors
/// Returns an error if the attributes are damaged.
pub(crate) fn attribute(element: &BytesStart<'_>, key: &str) -> Result<Option<String>, String> {
    let found = element.try_get_attribute(key);
    let Some(found) = found.map_err(|error| error.to_string())? else {
        return Ok(None);
    };
    let value = found.normalized_value(XmlVersion::default());
    Ok(Some(value.map_err(|error| error.to_string())?.into_owned()))
}

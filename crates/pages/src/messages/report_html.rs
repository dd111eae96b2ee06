//! The HTML report in Vietnamese. Its texts are replaced in the English page, whose names, commands and files stay.

use super::message_words::vietnamese;
use super::report_words::{report_text, verdict_text};
use crate::review::Language;

/// Beginnings of tags whose text is data: names, commands, styles.
const DATA: [&str; 6] = [
    "<style",
    "<h1",
    "<code",
    "<strong",
    "<span class=\"files\"",
    "<span class=\"character\"",
];
/// Attributes with texts.
const ATTRIBUTES: [&str; 3] = [" aria-label=\"", " alt=\"", " title=\""];
/// Begins the table whose rows are named by blocks.
const BLOCKS: &str = "<div class=\"wide\" id=\"table-blocks\"";

/// Returns an HTML report in a language. It is made in English, and what is not known stays so.
pub fn report_page(page: String, language: Language) -> String {
    match language {
        Language::English => page,
        Language::Vietnamese => in_vietnamese(&page),
    }
}

fn in_vietnamese(page: &str) -> String {
    let (mut said, mut rest) = (String::with_capacity(page.len() + page.len() / 4), page);
    let (mut tag, mut is_of_blocks) = ("", false);
    while let Some(start) = rest.find('<') {
        let (text, tail) = rest.split_at(start);
        said.push_str(&text_after(tag, text, is_of_blocks));
        let end = tail.find('>').map_or(tail.len(), |end| end + 1);
        (tag, rest) = tail.split_at(end);
        is_of_blocks = tag.starts_with(BLOCKS) || (is_of_blocks && tag != "</table>");
        said.push_str(&translated_tag(tag));
    }
    said.push_str(rest);
    said
}

/// Returns the text that follows a tag.
fn text_after(tag: &str, text: &str, is_of_blocks: bool) -> String {
    let is_data = DATA.iter().any(|data| tag.starts_with(data));
    let is_block = is_of_blocks && tag.starts_with("<th scope=\"row\"");
    if is_data || is_block || !text.contains(char::is_alphanumeric) {
        return text.to_owned();
    }
    let known = match tag {
        "</strong>" => plain(text).strip_prefix(", ").map(failure),
        "<span class=\"verdict\">" => verdict_text(&plain(text)),
        _ => None,
    };
    known.map_or_else(|| translated(text), |known| escaped(&known))
}

/// Returns the stage and the message of a failed pair.
fn failure(text: &str) -> String {
    match text.split_once(": ") {
        Some((stage, message)) => {
            let known = vietnamese(message);
            format!(", {stage}: {}", known.as_deref().unwrap_or(message))
        }
        None => format!(", {text}"),
    }
}

/// Returns a tag whose texts and language are Vietnamese.
fn translated_tag(tag: &str) -> String {
    if tag == "<html lang=\"en\">" {
        return "<html lang=\"vi\">".to_owned();
    }
    let Some(start) = (ATTRIBUTES.iter()).find_map(|name| Some(tag.find(name)? + name.len()))
    else {
        return tag.to_owned();
    };
    let (before, tail) = tag.split_at(start);
    let (text, after) = tail.split_at(tail.find('"').unwrap_or(tail.len()));
    [before, &translated(text), after].concat()
}

/// Returns a text of HTML with the blanks at its ends.
fn translated(text: &str) -> String {
    let words = text.trim();
    let known = report_text(&plain(words).replace("\u{202f}%", " %"));
    text.replacen(words, &escaped(&known.replace(" %", "\u{202f}%")), 1)
}

/// Returns a text without the escapes of HTML.
fn plain(text: &str) -> String {
    let text = text.replace("&lt;", "<").replace("&gt;", ">");
    text.replace("&quot;", "\"").replace("&amp;", "&")
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('"', "&quot;");
    text.replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::report_page;
    use crate::review::Language;

    /// Pages as the crate `report` makes them, without their styles.
    const PAGES: [&str; 2] = [
        include_str!(
            "../../../report/src/render/snapshots/mocban_report__render__snapshot_tests__full_html.snap"
        ),
        include_str!(
            "../../../report/src/render/snapshots/mocban_report__render__snapshot_tests__judged_html.snap"
        ),
    ];
    /// Words that only English sentences have.
    const ENGLISH: [&str; 12] = [
        " the ",
        "The ",
        " of ",
        " and ",
        " is ",
        " are ",
        " by ",
        "esults",
        " with ",
        "eviewer",
        "erdict",
        "onfidence",
    ];

    /// Returns what a page says, a text or a description a line, without the messages of failed pairs and commands.
    fn said(page: &str) -> Vec<String> {
        let (_, body) = page.split_once("<!DOCTYPE").expect("a page");
        let described = body
            .replace(" aria-label=\"", ">")
            .replace("\" viewBox", "<");
        let texts = described
            .split('>')
            .filter_map(|part| part.split('<').next());
        let texts = texts.map(str::trim).filter(|text| !text.is_empty());
        let is_data = |text: &&str| text.starts_with(", fit: ") || text.starts_with("mocban ");
        texts
            .filter(|text| !is_data(text))
            .map(str::to_owned)
            .collect()
    }

    #[test]
    fn a_vietnamese_report_has_no_english_sentence() {
        for page in PAGES {
            assert_eq!(report_page(page.to_owned(), Language::English), page);
            let vietnamese = report_page(page.to_owned(), Language::Vietnamese);
            assert_eq!(said(page).len(), said(&vietnamese).len());
            for text in said(&vietnamese) {
                let found = ENGLISH.iter().find(|word| text.contains(**word));
                assert_eq!(found, None, "{text}");
            }
            for part in ["<html lang=\"vi\">", "Độ đo", "người đánh giá cho đạt"] {
                assert!(vietnamese.contains(part), "{part}");
            }
            assert_eq!(page.matches('<').count(), vietnamese.matches('<').count());
        }
    }

    #[test]
    fn names_notes_and_files_stay() {
        let page = concat!(
            "<h1>all</h1><strong>all</strong>, fit: a.png is not there</li>",
            "<span class=\"verdict\">lan: fail, angle (“1.5 &lt;b&gt;”)</span><span class=\"files\">all · 1.5</span>",
            "<div class=\"wide\" id=\"table-blocks\" aria-label=\"Block\"><th scope=\"row\">all</th></table>",
            "<th scope=\"row\">all</th>",
        );
        let expected = concat!(
            "<h1>all</h1><strong>all</strong>, fit: không có tệp a.png</li>",
            "<span class=\"verdict\">lan: không đạt, sai góc (“1.5 &lt;b&gt;”)</span><span class=\"files\">all · 1.5</span>",
            "<div class=\"wide\" id=\"table-blocks\" aria-label=\"Ván\"><th scope=\"row\">all</th></table>",
            "<th scope=\"row\">tất cả</th>",
        );
        assert_eq!(report_page(page.to_owned(), Language::Vietnamese), expected);
    }
}

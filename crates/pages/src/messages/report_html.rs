//! The HTML report in Vietnamese. Its texts are replaced in the English page, whose names, commands and files stay.

use super::report_words::{message_text, report_text, verdict_text};
use super::stage_words::stage_text;

/// Beginnings of tags whose text is data: names, commands, styles.
const DATA: [&str; 6] = [
    "<style",
    "<h1",
    "<code",
    "<strong",
    "<span class=\"files\"",
    "<span class=\"character\"",
];
/// Descriptions of images, which begin with the id of a pair.
const ALT: &str = " alt=\"";
/// Attributes with texts.
const ATTRIBUTES: [&str; 3] = [" aria-label=\"", ALT, " title=\""];
/// Begins the table whose rows are named by blocks.
const BLOCKS: &str = "<div class=\"wide\" id=\"table-blocks\"";

/// Returns an HTML report, which is made in English, in Vietnamese. What is not known stays as it is.
pub(crate) fn vietnamese_report(page: &str) -> String {
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
        "<title>" => plain(text).strip_prefix("Report on ").map(titled),
        "</strong>" => plain(text).strip_prefix(", ").map(failure),
        "<span class=\"verdict\">" => Some(verdict_or_problem(&plain(text))),
        _ => None,
    };
    known.map_or_else(|| translated(text), |known| escaped(&known))
}

/// Returns the title of the page of a project.
fn titled(project: &str) -> String {
    format!("Báo cáo về {project}")
}

/// Returns the stage and the message of a failed pair.
fn failure(text: &str) -> String {
    match text.split_once(": ") {
        Some((stage, message)) => {
            let stage = stage_text(stage).unwrap_or(stage);
            format!(", {stage}: {}", message_text(message))
        }
        None => format!(", {text}"),
    }
}

/// Returns a verdict, or why a result was not drawn. Notes of reviewers stay as they are.
fn verdict_or_problem(text: &str) -> String {
    if let Some(verdict) = verdict_text(text) {
        return verdict;
    }
    match text.strip_prefix("not drawn: ") {
        Some(message) => format!("không vẽ được: {}", message_text(message)),
        None => text.to_owned(),
    }
}

/// Returns the description of an image.
fn image_text(text: &str) -> String {
    match text.rsplit_once(": ") {
        Some((pair, layer)) => format!("{pair}: {}", report_text(layer)),
        None => text.to_owned(),
    }
}

/// Returns a tag whose texts and language are Vietnamese.
fn translated_tag(tag: &str) -> String {
    if tag == "<html lang=\"en\">" {
        return "<html lang=\"vi\">".to_owned();
    }
    let found = ATTRIBUTES.into_iter().find_map(|name| {
        let start = tag.find(name)? + name.len();
        Some((name, start))
    });
    let Some((name, start)) = found else {
        return tag.to_owned();
    };
    let (before, tail) = tag.split_at(start);
    let (text, after) = tail.split_at(tail.find('"').unwrap_or(tail.len()));
    let known = if name == ALT {
        escaped(&image_text(&plain(text)))
    } else {
        translated(text)
    };
    [before, &known, after].concat()
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
mod size_tests;
#[cfg(test)]
mod tests;

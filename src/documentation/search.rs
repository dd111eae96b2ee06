//! The texts of all pages by section, in which the script of the pages searches.

use pulldown_cmark::{Event, Options, Parser, TagEnd};
use serde::Serialize;

use super::html::{Outline, anchor, language, web_path};

/// A part of a page below a heading.
#[derive(Debug, Default, PartialEq, Eq, Serialize)]
struct SearchSection {
    path: String,
    title: String,
    language: &'static str,
    heading: String,
    /// Id of the heading. Empty before the first one.
    anchor: String,
    text: String,
}

/// Returns the script that holds the sections of pages, which are paths below `docs/` with Markdown.
pub(super) fn search_index(pages: &[(&str, &str)], outline: &Outline) -> String {
    let pages = pages.iter();
    let sections: Vec<_> = pages
        .flat_map(|(path, markdown)| sections(path, markdown, outline))
        .collect();
    let json = serde_json::to_string(&sections).unwrap_or_else(|_| "[]".to_owned());
    format!("window.mocbanSearch = {json};\n")
}

fn sections(path: &str, markdown: &str, outline: &Outline) -> Vec<SearchSection> {
    let title = outline.title(path);
    let begin = |heading: &str| SearchSection {
        path: web_path(path),
        title: title.to_owned(),
        language: language(path),
        heading: heading.to_owned(),
        anchor: anchor(heading),
        text: String::new(),
    };
    let mut sections = vec![SearchSection {
        anchor: String::new(),
        ..begin(title)
    }];
    let mut text = String::new();
    let end = |text: &mut String, sections: &mut Vec<SearchSection>| {
        let words: Vec<&str> = text.split_whitespace().collect();
        if let Some(last) = sections.last_mut() {
            last.text = words.join(" ");
        }
        text.clear();
    };
    for event in Parser::new_ext(markdown, Options::ENABLE_TABLES) {
        match event {
            Event::Start(pulldown_cmark::Tag::Heading { .. }) => end(&mut text, &mut sections),
            Event::End(TagEnd::Heading(_)) => {
                let heading = std::mem::take(&mut text).trim().to_owned();
                // The first heading is the title of the page.
                if sections.len() > 1 || !sections[0].text.is_empty() || heading != title {
                    sections.push(begin(&heading));
                }
            }
            Event::Text(part) | Event::Code(part) => text.push_str(&part),
            Event::SoftBreak | Event::HardBreak | Event::End(_) => text.push(' '),
            _ => {}
        }
    }
    end(&mut text, &mut sections);
    sections.retain(|section| !section.text.is_empty());
    sections
}

#[cfg(test)]
mod tests {
    use super::{Outline, search_index};

    #[test]
    fn sections_have_the_text_below_their_headings() {
        let outline = Outline::parse("[Judge results](guides/judging.md)");
        let page = "# Judge results\n\nPress `P`.\n\n## Two *reviewers*\n\n| a | b |\n|---|---|\n| c | d |\n";
        let index = search_index(&[("guides/judging.md", page)], &outline);
        let json = index.trim_start_matches("window.mocbanSearch = ");
        let json = json.trim_end().trim_end_matches(';');
        let found: serde_json::Value = serde_json::from_str(json).expect("JSON");
        assert_eq!(found.as_array().map(Vec::len), Some(2));
        assert_eq!(found[0]["text"], "Press P.");
        assert_eq!(found[0]["anchor"], "");
        assert_eq!(found[1]["path"], "guides/judging.html");
        assert_eq!(found[1]["anchor"], "two-reviewers");
        assert_eq!(found[1]["heading"], "Two reviewers");
        assert_eq!(found[1]["text"], "a b c d");
    }
}

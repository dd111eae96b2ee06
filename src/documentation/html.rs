//! Turns a page of the documentation from Markdown into HTML.

use maud::{DOCTYPE, PreEscaped, html};
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd};

/// The table of contents.
#[derive(Debug)]
pub(super) struct Outline(Vec<OutlineEntry>);

/// A line of the table of contents.
#[derive(Debug)]
enum OutlineEntry {
    Part(String),
    /// The title of a page and its path below `docs/`.
    Page(String, String),
}

impl Outline {
    /// Parses `SUMMARY.md`: a heading for each part, and a link to each page.
    pub(super) fn parse(summary: &str) -> Self {
        let (mut entries, mut text, mut target) = (Vec::new(), String::new(), String::new());
        for event in Parser::new(summary) {
            match event {
                Event::Start(Tag::Heading { .. }) => text.clear(),
                Event::Start(Tag::Link { dest_url, .. }) => {
                    text.clear();
                    target = dest_url.into_string();
                }
                Event::Text(part) => text.push_str(&part),
                Event::End(TagEnd::Heading(_)) => entries.push(OutlineEntry::Part(text.clone())),
                Event::End(TagEnd::Link) => {
                    entries.push(OutlineEntry::Page(text.clone(), target.clone()));
                }
                _ => {}
            }
        }
        Self(entries)
    }

    /// Returns the title of a page.
    fn title(&self, path: &str) -> &str {
        let mut pages = self.0.iter();
        let title = pages.find_map(|entry| match entry {
            OutlineEntry::Page(title, found) if found == path => Some(title.as_str()),
            OutlineEntry::Page(..) | OutlineEntry::Part(_) => None,
        });
        title.unwrap_or("mocban")
    }
}

/// Returns the path of the web page of a Markdown file.
pub(super) fn web_path(path: &str) -> String {
    match path.strip_suffix(".md") {
        Some("introduction") => "index.html".to_owned(),
        Some(stem) => format!("{stem}.html"),
        None => path.to_owned(),
    }
}

/// Returns a Markdown file as a web page with the table of contents. `path` is the path of the file below `docs/`.
pub(super) fn web_page(path: &str, markdown: &str, outline: &Outline) -> String {
    let to_root = "../".repeat(path.matches('/').count());
    let language = if path.starts_with("vi/") { "vi" } else { "en" };
    let page = html! {
        (DOCTYPE)
        html lang=(language) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (outline.title(path)) " - mocban" }
                link rel="stylesheet" href=(format!("{to_root}style.css"));
            }
            body {
                nav aria-label="Contents" {
                    @for entry in &outline.0 {
                        @match entry {
                            OutlineEntry::Part(title) => p { (title) },
                            OutlineEntry::Page(title, target) => {
                                a href=(format!("{to_root}{}", web_path(target)))
                                    aria-current=[(target == path).then_some("page")] { (title) }
                            }
                        }
                    }
                }
                main { (PreEscaped(content(markdown))) }
            }
        }
    };
    page.into_string()
}

/// Returns the HTML of Markdown. Headings get ids, and links to Markdown files lead to their web pages.
fn content(markdown: &str) -> String {
    let events: Vec<Event<'_>> = Parser::new_ext(markdown, Options::ENABLE_TABLES).collect();
    let mut html = String::new();
    let with_ids = events.iter().enumerate().map(|(at, event)| match event {
        Event::Start(Tag::Heading {
            level,
            classes,
            attrs,
            ..
        }) => Event::Start(Tag::Heading {
            level: *level,
            id: Some(anchor(&heading_text(&events[at + 1..])).into()),
            classes: classes.clone(),
            attrs: attrs.clone(),
        }),
        Event::Start(Tag::Link {
            link_type,
            dest_url,
            title,
            id,
        }) => Event::Start(Tag::Link {
            link_type: *link_type,
            dest_url: web_link(dest_url),
            title: title.clone(),
            id: id.clone(),
        }),
        other => other.clone(),
    });
    pulldown_cmark::html::push_html(&mut html, with_ids);
    with_focusable_frames(&html)
}

/// Lets keyboards reach and scroll what may be wider than the page: code, and tables, which get a frame.
fn with_focusable_frames(html: &str) -> String {
    html.replace("<pre>", "<pre tabindex=\"0\">")
        .replace("<table>", "<div class=\"wide\" tabindex=\"0\"><table>")
        .replace("</table>", "</table></div>")
}

/// Returns the text from the beginning of a heading to its end.
fn heading_text(events: &[Event<'_>]) -> String {
    let inside = events
        .iter()
        .take_while(|event| !matches!(event, Event::End(TagEnd::Heading(_))));
    let text = inside.filter_map(|event| match event {
        Event::Text(text) | Event::Code(text) => Some(&**text),
        _ => None,
    });
    text.collect()
}

/// Returns the id of a heading, as GitHub forms it: lower case, hyphens for spaces, no punctuation.
pub fn anchor(heading: &str) -> String {
    let lower = heading.to_lowercase();
    let kept = lower
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Returns a link with the path of the web page in place of that of a Markdown file.
fn web_link<'a>(link: &CowStr<'a>) -> CowStr<'a> {
    if link.contains("://") {
        return link.clone();
    }
    let (path, anchor) = match link.split_once('#') {
        Some((path, anchor)) => (path, format!("#{anchor}")),
        None => (&**link, String::new()),
    };
    let folder = path.rfind('/').map_or("", |slash| &path[..=slash]);
    let page = web_path(&path[folder.len()..]);
    format!("{folder}{page}{anchor}").into()
}

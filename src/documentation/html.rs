//! Turns a page of the documentation from Markdown into HTML.

use maud::{DOCTYPE, Markup, PreEscaped, html};
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

    /// Returns the pages before and after a page of the same language: titles and paths.
    fn neighbours(&self, path: &str) -> [Option<(&str, &str)>; 2] {
        let entries = self.0.iter();
        let pages = entries.filter_map(|entry| match entry {
            OutlineEntry::Page(title, found) => Some((title.as_str(), found.as_str())),
            OutlineEntry::Part(_) => None,
        });
        let pages: Vec<_> = pages
            .filter(|(_, found)| language(found) == language(path))
            .collect();
        let Some(at) = pages.iter().position(|(_, found)| *found == path) else {
            return [None; 2];
        };
        [at.checked_sub(1), at.checked_add(1)].map(|at| pages.get(at?).copied())
    }

    /// Returns the title of a page.
    pub(super) fn title(&self, path: &str) -> &str {
        let mut pages = self.0.iter();
        let title = pages.find_map(|entry| match entry {
            OutlineEntry::Page(title, found) if found == path => Some(title.as_str()),
            OutlineEntry::Page(..) | OutlineEntry::Part(_) => None,
        });
        title.unwrap_or("mocban")
    }
}

/// Pages of the same content in English and in Vietnamese.
const TRANSLATIONS: [[&str; 2]; 1] = [["tutorial/first-hour.md", "vi/gio-dau-tien.md"]];

/// Returns the page in the other language with its language, if there is one.
fn translation(path: &str) -> Option<(&'static str, &'static str, &'static str)> {
    TRANSLATIONS.iter().find_map(|[english, vietnamese]| {
        if path == *english {
            Some((*vietnamese, "vi", "Tiếng Việt"))
        } else if path == *vietnamese {
            Some((*english, "en", "English"))
        } else {
            None
        }
    })
}

/// Returns the language of a page.
pub(super) fn language(path: &str) -> &'static str {
    if path.starts_with("vi/") { "vi" } else { "en" }
}

/// Texts around a page.
struct PageWords {
    contents: &'static str,
    search: &'static str,
    found: &'static str,
    previous: &'static str,
    next: &'static str,
}

impl PageWords {
    fn of(language: &str) -> Self {
        if language == "vi" {
            Self {
                contents: "Mục lục",
                search: "Tìm trong tài liệu",
                found: "{n} mục",
                previous: "Trang trước",
                next: "Trang sau",
            }
        } else {
            Self {
                contents: "Contents",
                search: "Search these pages",
                found: "{n} sections",
                previous: "Previous",
                next: "Next",
            }
        }
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
    let words = PageWords::of(language(path));
    let page = html! {
        (DOCTYPE)
        html lang=(language(path)) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content="mocban docs";
                title { (outline.title(path)) " - mocban" }
                link rel="stylesheet" href=(format!("{to_root}style.css"));
            }
            body {
                div.side {
                    (search_form(&words))
                    button #contents-button type="button" aria-expanded="false" aria-controls="contents" { (words.contents) }
                    (contents(path, outline, &to_root, &words))
                }
                main {
                    @if let Some((target, language, name)) = translation(path) {
                        p.translation {
                            a href=(format!("{to_root}{}", web_path(target))) lang=(language) hreflang=(language) { (name) }
                        }
                    }
                    (PreEscaped(content(markdown)))
                    (neighbours(path, outline, &to_root, &words))
                }
                script src=(format!("{to_root}documentation.js")) {}
            }
        }
    };
    page.into_string()
}

/// Returns the search, which the script shows and does.
fn search_form(words: &PageWords) -> Markup {
    html! {
        form #search role="search" {
            input #search-text type="search" placeholder=(words.search) aria-label=(words.search) autocomplete="off";
            p #search-status role="status" data-found=(words.found) {}
            ol #search-results {}
        }
    }
}

/// Returns the links to all pages.
fn contents(path: &str, outline: &Outline, to_root: &str, words: &PageWords) -> Markup {
    html! {
        nav #contents aria-label=(words.contents) {
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
    }
}

/// Returns the links to the pages before and after a page.
fn neighbours(path: &str, outline: &Outline, to_root: &str, words: &PageWords) -> Markup {
    let [before, after] = outline.neighbours(path);
    html! {
        nav.neighbours aria-label=(format!("{}, {}", words.previous, words.next)) {
            @if let Some((title, target)) = before {
                a rel="prev" href=(format!("{to_root}{}", web_path(target))) {
                    span { "← " (words.previous) } (title)
                }
            }
            @if let Some((title, target)) = after {
                a.next rel="next" href=(format!("{to_root}{}", web_path(target))) {
                    span { (words.next) " →" } (title)
                }
            }
        }
    }
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

#[cfg(test)]
mod tests {
    use super::{Outline, web_page};

    #[test]
    fn pages_lead_to_their_neighbours_and_to_the_other_language() {
        let outline = Outline::parse(
            "[Start](introduction.md)\n\n# Tutorial\n\n- [Hour](tutorial/first-hour.md)\n- [Judge](guides/judging.md)\n\n\
             # Tiếng Việt\n\n- [Giờ đầu tiên](vi/gio-dau-tien.md)\n",
        );
        let hour = web_page("tutorial/first-hour.md", "# Hour", &outline);
        assert!(
            hour.contains(r#"rel="prev" href="../index.html""#),
            "{hour}"
        );
        assert!(
            hour.contains(r#"rel="next" href="../guides/judging.html""#),
            "{hour}"
        );
        let other = r#"<a href="../vi/gio-dau-tien.html" lang="vi" hreflang="vi">Tiếng Việt</a>"#;
        assert!(hour.contains(other), "{hour}");
        let start = web_page("introduction.md", "# Start", &outline);
        assert!(
            !start.contains("rel=\"prev\"") && start.contains("rel=\"next\""),
            "{start}"
        );
        let last = web_page("guides/judging.md", "# Judge", &outline);
        assert!(
            !last.contains("rel=\"next\""),
            "the next page is in another language"
        );
        let vietnamese = web_page("vi/gio-dau-tien.md", "# Giờ", &outline);
        assert!(vietnamese.contains(">English</a>") && vietnamese.contains("Mục lục"));
    }
}

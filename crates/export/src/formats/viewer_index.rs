//! The index of the format `viewer`: pages with a picture of each pair with a result, in the order of the catalog.

use std::path::PathBuf;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::export_folder::{FolderError, SharedFile};
use crate::record::{MetricFields, PairFields};

/// The first page of the index, and its meaning.
pub(super) const INDEX: [&str; 2] = [
    "index.html",
    "pictures of all pairs with a result, each with a link to its page; `index-2.html` and so on continue it",
];
/// Pairs on a page.
const PAGE_PAIRS: u64 = 500;

const STYLE: &str = "\
:root { color-scheme: light dark; font: 15px/1.45 system-ui, \"Noto Sans\", sans-serif; }
body { margin: 0 auto; max-width: 1360px; padding: 14px; }
ul { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(190px, 44%), 1fr)); gap: 8px; list-style: none; padding: 0; }
li a { display: grid; gap: 2px; padding: 8px; border: 1px solid #8a847a; border-radius: 6px; color: inherit; text-decoration: none; min-width: 0; }
li a:hover, li a:focus-visible { outline: 3px solid #4a90d9; }
img { width: 100%; height: auto; aspect-ratio: 1; object-fit: contain; background: #8882; }
li span { overflow-wrap: anywhere; }
nav { display: flex; gap: 14px; margin: 14px 0; }
nav a { color: LinkText; }
";

/// Pages of the index that are being written.
pub(super) struct ViewerIndex {
    root: PathBuf,
    page: SharedFile,
    /// Names of all pages so far.
    names: Vec<String>,
    /// Pairs on the last page.
    count: u64,
}

impl ViewerIndex {
    /// Creates the first page below a folder.
    pub(super) fn begin(root: PathBuf) -> Result<Self, FolderError> {
        let name = page_name(1);
        let mut page = SharedFile::create(&root, &name)?;
        page.append(head(None).as_bytes())?;
        Ok(Self {
            root,
            page,
            names: vec![name],
            count: 0,
        })
    }

    /// Appends the item of a pair, on a new page if the last one is full.
    pub(super) fn append(&mut self, item: &[u8]) -> Result<(), FolderError> {
        if self.count == PAGE_PAIRS {
            let next = page_name(self.names.len() + 1);
            let mut page = SharedFile::create(&self.root, &next)?;
            page.append(head(self.names.last().map(String::as_str)).as_bytes())?;
            self.end_page(Some(&next))?;
            self.page = page;
            self.names.push(next);
            self.count = 0;
        }
        self.count += 1;
        self.page.append(item)
    }

    /// Completes the last page, and returns the names of all.
    pub(super) fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        self.end_page(None)?;
        Ok(std::mem::take(&mut self.names))
    }

    fn end_page(&mut self, next: Option<&str>) -> Result<(), FolderError> {
        self.page.append(tail(next).as_bytes())?;
        self.page.flush()
    }
}

/// Returns the item of a pair as HTML.
pub(super) fn index_item(pair: &PairFields, shown: &MetricFields) -> String {
    let folder = format!("pairs/{}", in_address(&pair.id.file_name()));
    let item = html! {
        li { a href={ (folder) "/viewer.html" } {
            img src={ (folder) "/overlay.jpg" } alt="" loading="lazy" width="190" height="190";
            span { b { (pair.id) } @if let Some(character) = &pair.character { " " span lang="zh-Hant" { (character) } } }
            @if let Some(block) = &pair.block { span { (block) } }
            @if let Some(confidence) = shown.confidence { span { "confidence " (format!("{confidence:.2}")) } }
        } }
    };
    item.into_string() + "\n"
}

/// Returns the name of a page of the index; the first is 1.
fn page_name(number: usize) -> String {
    match number {
        1 => INDEX[0].to_owned(),
        number => format!("index-{number}.html"),
    }
}

/// Returns a name of a folder as part of an address. A name has no slash.
fn in_address(name: &str) -> String {
    name.replace('%', "%25")
        .replace('#', "%23")
        .replace('?', "%3F")
}

fn link(page: Option<&str>, rel: &str, texts: [&str; 2]) -> Markup {
    let [english, vietnamese] = texts;
    html! {
        @if let Some(page) = page { a rel=(rel) href=(page) { (english) " · " span lang="vi" { (vietnamese) } } }
    }
}

/// Returns a page up to its first item.
fn head(before: Option<&str>) -> String {
    let title = "Carved blocks in 3D";
    let start = html! {
        (DOCTYPE)
        (PreEscaped("<html lang=\"en\">"))
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            title { (title) }
            style { (PreEscaped(STYLE)) }
        }
        (PreEscaped("<body><main>"))
        h1 { (title) " · " span lang="vi" { "Ván khắc trong 3D" } }
        @if before.is_some() { nav aria-label="Previous page" { (link(before, "prev", ["Previous page", "Trang trước"])) } }
        (PreEscaped("<ul>\n"))
    };
    start.into_string()
}

/// Returns what follows the last item of a page.
fn tail(next: Option<&str>) -> String {
    let end = html! {
        (PreEscaped("</ul>"))
        @if next.is_some() { nav aria-label="Next page" { (link(next, "next", ["Next page", "Trang sau"])) } }
        (PreEscaped("</main></body></html>\n"))
    };
    end.into_string()
}

#[cfg(test)]
mod tests {
    use super::{PAGE_PAIRS, ViewerIndex, in_address};

    #[test]
    fn pages_of_the_index_lead_to_each_other() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let mut index = ViewerIndex::begin(dir.path().to_owned()).expect("a page");
        for number in 0..=2 * PAGE_PAIRS {
            let item = format!("<li>{number}</li>");
            index.append(item.as_bytes()).expect("written");
        }
        let names = index.finish().expect("written");
        assert_eq!(names, ["index.html", "index-2.html", "index-3.html"]);
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).expect("a page");
        let [first, second, third] = ["index.html", "index-2.html", "index-3.html"].map(read);
        let items = |page: &str| page.matches("<li>").count() as u64;
        assert_eq!(
            [&first, &second, &third].map(|page| items(page)),
            [PAGE_PAIRS, PAGE_PAIRS, 1]
        );
        assert!(!first.contains("prev") && first.contains("href=\"index-2.html\""));
        assert!(second.contains("href=\"index.html\"") && second.contains("href=\"index-3.html\""));
        assert!(!third.contains("\"next\"") && third.ends_with("</html>\n"));
        assert_eq!(in_address("chữ 1%3F#2"), "chữ 1%253F%232");
    }
}

//! The files of `docs/`, which are part of the program.

use super::html::{Outline, web_page, web_path};
use super::search::search_index;

/// Returns pairs of paths below `docs/` and the content of these files.
macro_rules! of_docs {
    ($include:ident: $($path:literal),+ $(,)?) => {
        &[$(($path, $include!(concat!("../../docs/", $path)))),+]
    };
}

/// The table of contents.
const SUMMARY: &str = include_str!("../../docs/SUMMARY.md");

/// All pages.
const PAGES: &[(&str, &str)] = of_docs! {
    include_str:
    "architecture.md",
    "explanation/benchmarks.md",
    "explanation/method.md",
    "explanation/queue.md",
    "guides/app.md",
    "guides/blocks.md",
    "guides/cluster.md",
    "guides/demo.md",
    "guides/install.md",
    "guides/judging.md",
    "guides/operations.md",
    "guides/python.md",
    "guides/viewer.md",
    "introduction.md",
    "reference/commands.md",
    "reference/coordinates.md",
    "reference/data.md",
    "reference/labels.md",
    "reference/python.md",
    "reference/report.md",
    "reference/settings.md",
    "tutorial/first-hour.md",
    "vi/gio-dau-tien.md",
    "vi/python.md",
    "vi/thuat-ngu.md",
    "vi/ung-dung.md",
};

/// The pictures of the pages.
const PICTURES: &[(&str, &[u8])] = of_docs! {
    include_bytes:
    "pictures/app-vi.jpg",
    "pictures/app.jpg",
    "pictures/block-overlay.jpg",
    "pictures/block.jpg",
    "pictures/guide-vi.jpg",
    "pictures/guide.jpg",
    "pictures/practice-vi.jpg",
    "pictures/practice.jpg",
    "pictures/report-vi.png",
    "pictures/report.png",
    "pictures/review.jpg",
    "pictures/stages.png",
    "pictures/viewer-vi.jpg",
    "pictures/viewer.jpg",
};

/// The appearance of the pages.
const STYLE: &str = include_str!("../../assets/documentation/documentation.css");

/// The script of the pages.
const SCRIPT: &str = include_str!("../../assets/documentation/documentation.js");

/// Returns the files of the documentation: their paths below a folder, and their content. `index.html` is the first page.
pub fn web_files() -> Vec<(String, Vec<u8>)> {
    let outline = Outline::parse(SUMMARY);
    let pages = PAGES.iter().map(|(path, text)| {
        let page = web_page(path, text, &outline);
        (web_path(path), page.into_bytes())
    });
    let pictures = PICTURES.iter();
    let pictures = pictures.map(|(path, bytes)| ((*path).to_owned(), bytes.to_vec()));
    let index = search_index(PAGES, &outline);
    let others = [
        ("style.css", STYLE),
        ("documentation.js", SCRIPT),
        ("search-index.js", &index),
    ];
    let others = others.map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()));
    pages.chain(pictures).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use percent_encoding::percent_decode_str;

    use super::{PAGES, PICTURES, web_files};

    fn files_below(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                files_below(&path, found);
            } else {
                found.push(path);
            }
        }
    }

    #[test]
    fn every_file_of_the_book_is_part_of_the_program() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
        let mut found = Vec::new();
        files_below(&docs, &mut found);
        let relative = |path: &std::path::PathBuf| {
            let path = path.strip_prefix(&docs).expect("below docs");
            path.to_string_lossy().replace('\\', "/")
        };
        let mut expected: BTreeSet<String> = found.iter().map(relative).collect();
        assert!(expected.remove("SUMMARY.md"));
        let listed = PAGES.iter().map(|(path, _)| path);
        let listed = listed.chain(PICTURES.iter().map(|(path, _)| path));
        assert_eq!(
            listed
                .map(|path| (*path).to_owned())
                .collect::<BTreeSet<_>>(),
            expected
        );
    }

    /// Returns the values of an attribute in HTML.
    fn values<'a>(html: &'a str, attribute: &str) -> Vec<&'a str> {
        let start = format!(" {attribute}=\"");
        let parts = html.split(&start).skip(1);
        parts
            .map(|part| part.split('"').next().unwrap_or_default())
            .collect()
    }

    #[test]
    fn every_link_leads_to_a_written_file_and_a_heading() {
        let files = web_files();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        let mut links = 0;
        let is_page = |path: &str| Path::new(path).extension().is_some_and(|end| end == "html");
        for (path, bytes) in files.iter().filter(|(path, _)| is_page(path)) {
            let html = text(bytes);
            let folder = Path::new(path).parent().expect("a folder");
            for link in [values(&html, "href"), values(&html, "src")].concat() {
                if link.starts_with("http") {
                    continue;
                }
                links += 1;
                let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
                let anchor = percent_decode_str(anchor).decode_utf8().expect("UTF-8");
                let mut target = Vec::new();
                for part in folder.join(file).components() {
                    match part.as_os_str().to_str().expect("UTF-8") {
                        ".." => drop(target.pop()),
                        name => target.push(name.to_owned()),
                    }
                }
                let target = if file.is_empty() {
                    path.clone()
                } else {
                    target.join("/")
                };
                let found = files.iter().find(|(path, _)| *path == target);
                let (_, found) = found.unwrap_or_else(|| panic!("{path}: {link}"));
                let is_there = anchor.is_empty() || values(&text(found), "id").contains(&&*anchor);
                assert!(is_there, "{path}: {link}");
            }
        }
        assert!(links > 400, "{links} links");
    }
}

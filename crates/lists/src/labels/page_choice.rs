//! Choice of a page in a file about several pages.

use super::error::LabelsProblem;
use super::message::quoted;
use super::model::PageFile;
use mocban_core::domain::spelling::fold_case;

/// What a file says about one of its pages.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PageEntry {
    pub(super) file_name: Option<String>,
    /// Size of the page's file in bytes.
    pub(super) bytes: Option<u64>,
    pub(super) has_boxes: bool,
}

/// Returns a file name without folders for comparison: composed, in lower case.
pub(super) fn comparable(name: &str) -> String {
    let file = name.rsplit(['/', '\\']).next().unwrap_or_default();
    fold_case(file)
}

/// Returns whether two paths have the same file name. Folders, case and Unicode form are ignored.
pub(super) fn is_same_file(a: &str, b: &str) -> bool {
    comparable(a) == comparable(b)
}

/// Returns the index of the entry of a page: the one with its file name; else the one with its size in bytes; else the
/// only one that has boxes. Among entries with the same name, the size in bytes decides, then which one has boxes.
///
/// # Errors
/// Returns the pages in the file if none is this one, or the number of entries that match equally well.
pub(super) fn choose_page(
    entries: &[PageEntry],
    page: &PageFile<'_>,
) -> Result<usize, LabelsProblem> {
    let all = || 0..entries.len();
    let wanted = comparable(page.name);
    let name_of = |k: &usize| entries[*k].file_name.as_deref();
    let named: Vec<usize> = all()
        .filter(|k| name_of(k).is_some_and(|name| comparable(name) == wanted))
        .collect();
    let sized = |k: &usize| entries[*k].bytes == Some(page.bytes);
    let boxed = |k: &usize| entries[*k].has_boxes;
    if !named.is_empty() {
        let found = only(named.iter().copied())
            .or_else(|| only(named.iter().copied().filter(sized)))
            .or_else(|| only(named.iter().copied().filter(boxed)));
        let ambiguous = || LabelsProblem::AmbiguousPage(named.len(), page.name.to_owned());
        return found.ok_or_else(ambiguous);
    }
    if let Some(found) = only(all().filter(sized)).or_else(|| only(all().filter(boxed))) {
        return Ok(found);
    }
    if !entries.iter().any(|entry| entry.has_boxes) {
        return Err(LabelsProblem::NoBoxes(None));
    }
    let shown = |name: Option<&str>| name.map_or_else(|| "a page without name".to_owned(), quoted);
    let pages = all().filter(boxed).map(|k| shown(name_of(&k)));
    Err(LabelsProblem::OtherPages {
        page: page.name.to_owned(),
        pages: pages.collect(),
    })
}

/// Returns the item of an iterator that has exactly one.
fn only(mut items: impl Iterator<Item = usize>) -> Option<usize> {
    items.next().filter(|_| items.next().is_none())
}

#[cfg(test)]
mod tests {
    use super::{LabelsProblem, PageEntry, PageFile, choose_page};

    const PAGE: PageFile<'static> = PageFile {
        name: "scans/Chữ 1.JPG",
        bytes: 500,
        width: 10,
        height: 10,
    };

    fn entry(name: &str, bytes: u64, has_boxes: bool) -> PageEntry {
        PageEntry {
            file_name: Some(name.to_owned()),
            bytes: Some(bytes),
            has_boxes,
        }
    }

    #[test]
    fn file_names_are_equal_in_any_case_and_unicode_form() {
        for name in ["Chữ 1.JPG", "chu\u{31b}\u{303} 1.jpg", "D:\\a\\CHỮ 1.jpg"] {
            let entries = [entry("p2.jpg", 500, true), entry(name, 7, true)];
            assert_eq!(choose_page(&entries, &PAGE), Ok(1), "{name}");
        }
        assert!(super::is_same_file("ΟΔΟΣ.png", "a/οδος.png"));
    }

    #[test]
    fn without_its_name_the_size_decides_then_whether_there_is_only_one() {
        let sized = [entry("a.jpg", 400, true), entry("b.jpg", 500, true)];
        assert_eq!(choose_page(&sized, &PAGE), Ok(1));
        let only = [entry("a.jpg", 400, false), entry("b.jpg", 300, true)];
        assert_eq!(choose_page(&only, &PAGE), Ok(1));
        let others = [entry("a.jpg", 400, true), entry("b.jpg", 300, true)];
        let expected = LabelsProblem::OtherPages {
            page: PAGE.name.to_owned(),
            pages: vec!["\"a.jpg\"".to_owned(), "\"b.jpg\"".to_owned()],
        };
        assert_eq!(choose_page(&others, &PAGE), Err(expected));
        assert_eq!(choose_page(&[], &PAGE), Err(LabelsProblem::NoBoxes(None)));
    }

    #[test]
    fn entries_of_the_same_name_are_told_apart_by_size_then_by_boxes() {
        let name = "a/chữ 1.jpg";
        let sized = [entry(name, 400, true), entry(name, 500, true)];
        assert_eq!(choose_page(&sized, &PAGE), Ok(1));
        let boxed = [entry(name, 400, true), entry(name, 300, false)];
        assert_eq!(choose_page(&boxed, &PAGE), Ok(0));
        let equal = [entry(name, 400, true), entry(name, 300, true)];
        let expected = LabelsProblem::AmbiguousPage(2, PAGE.name.to_owned());
        assert_eq!(choose_page(&equal, &PAGE), Err(expected));
    }
}

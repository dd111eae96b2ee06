//! Changes of the pairs before an import, as the address of the page has them.

use super::address::PageQuery;
use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use mocban_lists::manifest::PairingChanges;

/// Longest changes of pairs, in bytes: they are part of addresses, and of an action.
const MAX_CHANGES: usize = 4000;

/// Refuses an address that the page did not make.
pub(super) fn not_of_page() -> AppFailure {
    AppFailure::refused(Sentence::new(
        "this address was not made by the page: choose the files again",
        "địa chỉ này không phải do trang tạo ra: hãy chọn lại các tệp",
    ))
}

/// Parses the changes of the pairs as the address has them.
///
/// # Errors
/// Refuses a text that is not one of the page's.
pub(super) fn changes(text: &str) -> AppResult<PairingChanges> {
    if text.is_empty() {
        return Ok(PairingChanges::default());
    }
    serde_json::from_str(text).map_err(|_invalid| not_of_page())
}

/// Returns the address with the change of the pairs that a link or a form has added to it. The same address gives the same.
///
/// # Errors
/// Refuses more changes than an address can have.
pub(super) fn with_change(query: &PageQuery) -> AppResult<PageQuery> {
    let before = query.get("matches").unwrap_or_default();
    let mut changes = changes(before)?;
    if let (Some(scan), Some(print)) = (query.get("scan"), query.get("print")) {
        let joined = (scan.to_owned(), print.to_owned());
        if !changes.joined.contains(&joined) {
            changes.joined.push(joined);
        }
    }
    if let Some(id) = query.get("leave").map(str::to_owned)
        && !changes.left_out.contains(&id)
    {
        changes.left_out.push(id);
    }
    if let Some(id) = query.get("take") {
        changes.take_back(id);
    }
    if let Some(at) = query.parsed::<usize>("split")
        && at < changes.joined.len()
    {
        changes.joined.remove(at);
    }
    let text = if changes == PairingChanges::default() {
        String::new()
    } else {
        // Texts always have a JSON form.
        serde_json::to_string(&changes).unwrap_or_default()
    };
    if text.len() > MAX_CHANGES && text.len() > before.len() {
        return Err(AppFailure::refused(Sentence::new(
            "too many pairs are changed for one import: import these first, or rename the files",
            "quá nhiều cặp được thay đổi trong một lần nhập: hãy nhập các cặp này trước, hoặc đổi tên các tệp",
        )));
    }
    Ok(without_change(query).with("matches", &text))
}

/// Returns the address without the change that a link or a form has added to it.
pub(super) fn without_change(query: &PageQuery) -> PageQuery {
    let names = ["scan", "print", "leave", "take", "split"].iter();
    names.fold(query.clone(), |query, name| query.with(name, ""))
}

#[cfg(test)]
mod tests {
    use super::{with_change, without_change};
    use crate::app::address::PageQuery;

    fn changed(query: &str) -> String {
        let query = with_change(&PageQuery::parse(query)).expect("few changes");
        query.get("matches").unwrap_or_default().to_owned()
    }

    #[test]
    fn changes_are_added_to_the_address_and_taken_back() {
        let one = r#"{"left_out":["1"],"joined":[["a.stl","b.png"]]}"#;
        let added = changed("leave=1&scan=a.stl&print=b.png");
        assert_eq!(added, one);
        let again = PageQuery::parse("leave=1&scan=a.stl&print=b.png").with("matches", one);
        let again = with_change(&again).expect("few changes");
        assert_eq!(again.get("matches"), Some(one), "a reload changes nothing");
        assert_eq!((again.get("leave"), again.get("scan")), (None, None));
        let back = with_change(&again.with("take", "1").with("split", "0"));
        assert_eq!(back.expect("no changes").text(), "");
        let joined = PageQuery::parse("leave=1&scan=1.stl&print=x.png");
        let joined = with_change(&joined).expect("few changes");
        let back = with_change(&joined.with("take", "1")).expect("no changes");
        assert_eq!(back.text(), "", "files of the pair are not joined any more");
        assert_eq!(changed("scan=a.stl"), "");
        with_change(&PageQuery::parse("matches=x")).expect_err("not of the page");
        let many = "x".repeat(5000);
        let refused = PageQuery::parse(&format!("list=a&leave={many}"));
        with_change(&refused).expect_err("too many");
        assert_eq!(without_change(&refused).text(), "?list=a");
    }
}

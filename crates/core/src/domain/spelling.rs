//! Forms in which names are compared, and the names that a mistyped name may stand for.

use std::borrow::Cow;

use unicode_normalization::char::is_combining_mark;
use unicode_normalization::{IsNormalized, UnicodeNormalization as _, is_nfc_quick};

use super::sanitize::is_hidden;

/// Returns a text in Unicode's composed form (NFC), in which the same name typed on macOS and on Windows is equal.
pub fn composed(text: &str) -> Cow<'_, str> {
    // Reading long lists needs the fast paths: almost all ids and paths are ASCII, and most others are composed.
    if text.is_ascii() || is_nfc_quick(text.chars()) == IsNormalized::Yes {
        Cow::Borrowed(text)
    } else {
        Cow::Owned(text.nfc().collect())
    }
}

/// Returns a text in quotation marks for a message, in composed form. Unlike `{:?}`, it shows combining marks, which some
/// letters need.
///
/// ```
/// use mocban_core::domain::spelling::quoted;
///
/// assert_eq!(quoted("Ba\u{309}n \"in\"\n"), "\"Bản \\\"in\\\"\\n\"");
/// assert_eq!(quoted("x\u{309}\u{202e}"), "\"x\u{309}\\u{202e}\"");
/// ```
pub fn quoted(text: &str) -> String {
    let mut shown = String::from("\"");
    for c in composed(text).chars() {
        if c == '\'' || is_combining_mark(c) && !is_hidden(c) {
            shown.push(c);
        } else {
            shown.extend(c.escape_debug());
        }
    }
    shown.push('"');
    shown
}

/// Returns a name as file systems compare it that ignore case, such as those of Windows and macOS.
pub fn fold_case(name: &str) -> String {
    if name.is_ascii() {
        return name.to_ascii_lowercase();
    }
    // Upper case first: some letters, such as the final sigma, have one upper and several lower forms.
    let folded = name.to_uppercase().to_lowercase();
    match composed(&folded) {
        Cow::Borrowed(_) => folded,
        Cow::Owned(composed) => composed,
    }
}

/// Returns a name in lower case, without accents and without zeros before numbers, so that `Khoi-4` is similar to
/// `khối-04`. Spreadsheets drop such zeros.
pub fn plain_form(name: &str) -> String {
    let letters = name.nfd().filter(|c| !is_combining_mark(*c));
    let letters = letters.map(|c| match c {
        'đ' | 'Đ' => 'd',
        c => c,
    });
    without_leading_zeros(&letters.collect::<String>().to_lowercase())
}

/// Returns a text without the zeros before its whole numbers.
pub fn without_leading_zeros(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let (before, number) = rest.split_at(at);
        let is_end = |c: char| !c.is_ascii_digit();
        let (digits, after) = number.split_at(number.find(is_end).unwrap_or(number.len()));
        let significant = digits.trim_start_matches('0');
        plain += before;
        plain += if significant.is_empty() {
            "0"
        } else {
            significant
        };
        rest = after;
    }
    plain + rest
}

/// Returns up to `limit` of the known names that are similar to a mistyped name, most similar first.
///
/// Two names are similar if they have the same [`plain_form`], if one starts with the other, or if their edit distance is 1
/// or at most a third of the longer name's length. Different names of one character are not.
pub fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
    limit: usize,
) -> Vec<&'a str> {
    let plain = plain_form(typed);
    let distance = |name| {
        let is_same = plain_form(name) == plain;
        is_same
            .then_some(0)
            .or_else(|| distance_if_similar(typed, name))
    };
    let mut ranked: Vec<(usize, &str)> = known
        .into_iter()
        .filter_map(|name| distance(name).map(|edits| (edits, name)))
        .collect();
    ranked.sort_unstable();
    ranked.dedup();
    ranked.truncate(limit);
    ranked.into_iter().map(|(_, name)| name).collect()
}

/// Returns a suggestion such as `; did you mean "workers"?`, or nothing if no name is similar.
pub fn hint<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(typed, known, 1).first() {
        Some(name) => format!("; did you mean {}?", quoted(name)),
        None => String::new(),
    }
}

/// Returns how many letters must be replaced, added, removed or swapped with their neighbour to turn one name into the other,
/// both in composed form.
///
/// ```
/// use mocban_core::domain::spelling::edit_distance;
///
/// assert_eq!(edit_distance("17.stl", "0017.stl"), 2);
/// ```
pub fn edit_distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(&composed(a), &composed(b))
}

fn distance_if_similar(typed: &str, name: &str) -> Option<usize> {
    let longer = typed.chars().count().max(name.chars().count());
    let allowed = (longer / 3).max(1);
    let edits = strsim::osa_distance(typed, name);
    let is_prefix = !typed.is_empty() && (name.starts_with(typed) || typed.starts_with(name));
    (edits <= allowed && edits < longer || is_prefix).then_some(edits)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::{prop_assert_eq, proptest};
    use unicode_normalization::UnicodeNormalization as _;

    use super::{composed, fold_case, hint, nearest, plain_form};

    proptest! {
        #[test]
        fn fast_paths_give_what_the_definitions_give(text in "[A-Za-z0-9 \\u{300}-\\u{36f}ẮữƯĐđİıßΣςKÅ가-각ᄀ-ᇿ天]{0,8}") {
            let nfc = |text: &str| text.nfc().collect::<String>();
            prop_assert_eq!(&*composed(&text), nfc(&text));
            prop_assert_eq!(fold_case(&text), nfc(&text.to_uppercase().to_lowercase()));
        }
    }

    #[test]
    fn another_letter_alone_is_not_suggested() {
        assert_eq!(hint("z", ["a", "b"]), "");
        assert_eq!(nearest("ab", ["az", "zz"], 2), ["az"]);
    }

    #[test]
    fn accents_case_and_leading_zeros_make_no_difference() {
        for (a, b) in [
            ("Khoi-4", "khối-04"),
            ("117", "0117"),
            ("b4_0", "b04_000"),
            ("Dia 7a", "đĩa 007a"),
        ] {
            assert_eq!(plain_form(a), plain_form(b), "{a}");
        }
        assert_ne!(plain_form("100"), plain_form("10"));
        assert_eq!(nearest("17", ["18", "0017"], 2), ["0017", "18"]);
    }

    #[test]
    fn similar_names_come_in_order_and_others_not_at_all() {
        let known = ["0001", "0011", "9999"];
        assert_eq!(nearest("001", known, 5), ["0001", "0011"]);
        assert!(nearest("zebra", known, 5).is_empty());
        assert_eq!(hint("zebra", known), "");
        assert_eq!(hint("0001x", ["0001"]), "; did you mean \"0001\"?");
        assert_eq!(
            hint("wrokers", ["workers"]),
            "; did you mean \"workers\"?",
            "a swap of neighbours is one edit"
        );
    }
}

//! Finds the names that a mistyped name may stand for.

/// Returns up to `limit` of the known names that are similar to a mistyped name, most similar first.
///
/// Two names are similar if one starts with the other, or if their edit distance is 1 or at most a third of the longer
/// name's length.
pub fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
    limit: usize,
) -> Vec<&'a str> {
    let mut ranked: Vec<(usize, &str)> = known
        .into_iter()
        .filter_map(|name| distance_if_similar(typed, name).map(|edits| (edits, name)))
        .collect();
    ranked.sort_unstable();
    ranked.dedup();
    ranked.truncate(limit);
    ranked.into_iter().map(|(_, name)| name).collect()
}

/// Returns a suggestion such as `; did you mean "workers"?`, or nothing if no name is similar.
pub fn hint<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(typed, known, 1).first() {
        Some(name) => format!("; did you mean {name:?}?"),
        None => String::new(),
    }
}

fn distance_if_similar(typed: &str, name: &str) -> Option<usize> {
    let longer = typed.chars().count().max(name.chars().count());
    let allowed = (longer / 3).max(1);
    let edits = strsim::osa_distance(typed, name);
    let is_prefix = !typed.is_empty() && (name.starts_with(typed) || typed.starts_with(name));
    (edits <= allowed || is_prefix).then_some(edits)
}

#[cfg(test)]
mod tests {
    use super::{hint, nearest};

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

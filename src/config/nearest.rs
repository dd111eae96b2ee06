//! "Did you mean": the known names that lie nearest to a mistyped one.

/// Up to `limit` of the known names that are near enough to be what was meant, nearest first.
///
/// Near enough is at most a third of the longer name in edits, or one name beginning with the other.
pub fn nearest<'a>(
    typed: &str,
    known: impl IntoIterator<Item = &'a str>,
    limit: usize,
) -> Vec<&'a str> {
    let mut ranked: Vec<(usize, &str)> = known
        .into_iter()
        .filter_map(|name| distance_if_near(typed, name).map(|edits| (edits, name)))
        .collect();
    ranked.sort_unstable();
    ranked.dedup();
    ranked.truncate(limit);
    ranked.into_iter().map(|(_, name)| name).collect()
}

/// A tail such as `; did you mean "workers"?`, empty when nothing is near.
pub fn hint<'a>(typed: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(typed, known, 1).first() {
        Some(name) => format!("; did you mean {name:?}?"),
        None => String::new(),
    }
}

fn distance_if_near(typed: &str, name: &str) -> Option<usize> {
    let longer = typed.chars().count().max(name.chars().count());
    let allowed = (longer / 3).max(1);
    let edits = edit_distance(typed, name);
    let begins = !typed.is_empty() && (name.starts_with(typed) || typed.starts_with(name));
    (edits <= allowed || begins).then_some(edits)
}

/// Insertions, deletions, replacements and swaps of neighbours that turn one text into the other
/// (optimal string alignment).
fn edit_distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.chars().collect();
    let b: Vec<char> = b.chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(before[j - 2] + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{edit_distance, hint, nearest};

    #[test]
    fn edits_are_counted() {
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("wrokers", "workers"), 1);
    }

    #[test]
    fn nearest_names_come_first_and_far_ones_not_at_all() {
        let known = ["0001", "0011", "9999"];
        assert_eq!(nearest("001", known, 5), ["0001", "0011"]);
        assert!(nearest("zebra", known, 5).is_empty());
        assert_eq!(hint("zebra", known), "");
        assert_eq!(hint("0001x", ["0001"]), "; did you mean \"0001\"?");
    }
}

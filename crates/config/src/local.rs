//! Makes the settings of a backup local: comments out the places outside of the project, such as a server.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::tree::flatten;
use mocban_core::domain::is_address;

/// Settings of the section `storage` that name a place.
const PLACES: [&str; 3] = ["catalog", "artifacts", "cache"];

/// Comment above the settings that were commented out.
const REASON: &str = "\
# `restore` commented these settings out: a restored project uses only its own folder. To use a server again, copy the
# catalog to an address without one (mocban copy FOLDER postgres://me@db.example/lab) and set storage.catalog to it; give
# storage.artifacts a folder of its own.";

/// Settings of a file that lead to no other place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocalSettings {
    /// The text of the file.
    pub text: String,
    /// Dotted keys of the settings that were commented out, in the order of the file.
    pub removed: Vec<String>,
}

/// Comments out the settings of a file that name a catalog on a server, an object store, or a folder for local copies. All
/// other lines stay as they are. Comments out the whole file if it is not valid TOML, or if single lines cannot be
/// commented out.
pub fn make_local(bytes: &[u8]) -> LocalSettings {
    let text = String::from_utf8_lossy(bytes);
    let (Ok(document), Ok(before)) = (DeTable::parse(&text), text.parse::<Table>()) else {
        return all_removed(&text, Vec::new());
    };
    let places = places(document.get_ref());
    if places.is_empty() {
        return LocalSettings {
            text: text.into_owned(),
            removed: Vec::new(),
        };
    }
    let local = comment_out(&text, &places);
    let before = values(&before);
    match removed(&before, &local) {
        Some(removed) => LocalSettings {
            text: local,
            removed,
        },
        None => all_removed(&text, before),
    }
}

/// Returns the keys of the values that a text lacks. Returns `None` if the text names a place or has another value.
fn removed(before: &[(String, Value)], local: &str) -> Option<Vec<String>> {
    if !places(DeTable::parse(local).ok()?.get_ref()).is_empty() {
        return None;
    }
    let after: Table = local.parse().ok()?;
    let mut after: BTreeMap<_, _> = values(&after).into_iter().collect();
    let mut removed = Vec::new();
    for (key, value) in before {
        match after.remove(key) {
            None => removed.push(key.clone()),
            Some(left) if left == *value => {}
            Some(_) => return None,
        }
    }
    after.is_empty().then_some(removed)
}

/// Returns every value of a document with its dotted key.
fn values(table: &Table) -> Vec<(String, Value)> {
    let mut values = Vec::new();
    flatten(table, "", &mut |key, value| {
        // A section may be left without a key.
        if !value.is_table() {
            values.push((key, value.clone()));
        }
    });
    values
}

fn all_removed(text: &str, values: Vec<(String, Value)>) -> LocalSettings {
    // A comment cannot have other control characters.
    let plain = |c: char| match c {
        '\n' | '\t' => c,
        c if c.is_control() => '\u{fffd}',
        c => c,
    };
    let text: String = text.replace("\r\n", "\n").chars().map(plain).collect();
    let everything = 0..text.len();
    let mut removed: Vec<_> = values.into_iter().map(|(key, _)| key).collect();
    if removed.is_empty() {
        removed.push("all settings".to_owned());
    }
    LocalSettings {
        text: comment_out(&text, std::slice::from_ref(&everything)),
        removed,
    }
}

/// Comments out the lines of the given bytes, and says why above the first one.
fn comment_out(text: &str, places: &[Range<usize>]) -> String {
    let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let mut places: Vec<_> = places.iter().collect();
    places.sort_by_key(|place| place.start);
    let mut places = places.into_iter().peekable();
    let mut local = String::new();
    let (mut start, mut is_explained) = (0, false);
    for line in text.split_inclusive('\n') {
        while places.next_if(|place| place.end <= start).is_some() {}
        if places
            .peek()
            .is_some_and(|place| place.start < start + line.len())
        {
            if !is_explained {
                local.extend(REASON.lines().flat_map(|line| [line, end]));
                is_explained = true;
            }
            local.push_str("# ");
        }
        local.push_str(line);
        start += line.len();
    }
    local
}

/// Returns where the settings are that name places, from the key to the end of the value.
fn places(document: &DeTable<'_>) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for (key, value) in document {
        if key.get_ref() != "storage" {
            continue;
        }
        let DeValue::Table(storage) = value.get_ref() else {
            found.push(key.span().start..value.span().end);
            continue;
        };
        for (key, value) in storage {
            let all = key.span().start..value.span().end;
            match (&**key.get_ref(), value.get_ref()) {
                ("roots", DeValue::Table(roots)) => {
                    let roots = roots.iter().filter(|(_, root)| !is_folder(root.get_ref()));
                    found.extend(roots.map(|(key, root)| key.span().start..root.span().end));
                }
                ("roots", _) => found.push(all),
                (name, value) if PLACES.contains(&name) && value.as_str() != Some("") => {
                    found.push(all);
                }
                _ => {}
            }
        }
    }
    found
}

/// Returns whether the value of a root is a folder of this computer. The paths of inputs in a backup may be those of any
/// file anyway, but an address would be asked with the keys of the user.
fn is_folder(root: &DeValue<'_>) -> bool {
    root.as_str().is_some_and(|root| !is_address(root))
}

#[cfg(test)]
mod tests {
    use super::{LocalSettings, REASON, make_local};

    /// Returns the text with the reason above the first line that begins with `# `.
    fn with_reason(text: &str) -> String {
        text.replacen("<reason>", REASON, 1)
    }

    #[test]
    fn only_settings_that_lead_elsewhere_are_commented_out() {
        for (before, after, removed) in [
            (
                "# mine\n[storage]\ncatalog = \"postgres://me@db/lab\" # the lab\ncache_gb = 7\n\n[depth]\nlongest_px = 96\n",
                "# mine\n[storage]\n<reason>\n# catalog = \"postgres://me@db/lab\" # the lab\ncache_gb = 7\n\n[depth]\nlongest_px = 96\n",
                vec!["storage.catalog"],
            ),
            (
                "storage.artifacts = 's3://lab/x'\nrun.workers = 2",
                "<reason>\n# storage.artifacts = 's3://lab/x'\nrun.workers = 2",
                vec!["storage.artifacts"],
            ),
            (
                "\"storage\".\"cat\\u0061log\" = '''\npostgres://me@db/\nlab'''\nrun.workers = 2\n",
                "<reason>\n# \"storage\".\"cat\\u0061log\" = '''\n# postgres://me@db/\n# lab'''\nrun.workers = 2\n",
                vec!["storage.catalog"],
            ),
            (
                "[storage.roots]\nscans = \"/mnt/scans\"\npages = \"s3://lab/pages\"\n",
                "[storage.roots]\nscans = \"/mnt/scans\"\n<reason>\n# pages = \"s3://lab/pages\"\n",
                vec!["storage.roots.pages"],
            ),
            (
                "[run]\nworkers = 2\n[storage]\nroots = { a = \"/x\", b = \"s3://lab\" }\n  cache = \"/tmp/x\"\n",
                "[run]\nworkers = 2\n[storage]\n<reason>\n# roots = { a = \"/x\", b = \"s3://lab\" }\n#   cache = \"/tmp/x\"\n",
                vec!["storage.roots.a", "storage.roots.b", "storage.cache"],
            ),
            (
                "storage = { catalog = \"postgres://me@db/lab\", cache_gb = 7 }\nrun = { workers = 2 }\n",
                "<reason>\n# storage = { catalog = \"postgres://me@db/lab\", cache_gb = 7 }\nrun = { workers = 2 }\n",
                vec!["storage.catalog", "storage.cache_gb"],
            ),
        ] {
            let expected = LocalSettings {
                text: with_reason(after),
                removed: removed.into_iter().map(ToOwned::to_owned).collect(),
            };
            assert_eq!(make_local(before.as_bytes()), expected);
        }
    }

    #[test]
    fn settings_without_places_stay_byte_for_byte() {
        for text in [
            "",
            "\u{feff}[run]\r\nworkers = 2\r\n",
            "# catalog = \"postgres://me@db/lab\"\n[storage]\ncatalog = \"\"\nroots.scans = \"/mnt/x\"",
            "preset = \"paper\"\n",
        ] {
            let local = make_local(text.as_bytes());
            assert_eq!((&*local.text, &local.removed[..]), (text, &[][..]));
        }
    }

    #[test]
    fn no_form_leaves_a_place() {
        for text in [
            "storage = { catalog = \"postgres://me@db/lab\",\n cache_gb = 7 }\nrun.workers = 2\n",
            "storage = {\n catalog = \"postgres://me@db/lab\",\n cache_gb = 7\n}\n",
            "[[storage]]\ncatalog = \"postgres://me@db/lab\"\n",
            "[storage.roots.scans]\nurl = \"s3://lab\"\n",
            "[storage]\nroots = [\n\"s3://lab\",\n\"s3://x\"]\n",
            "[storage]\r\nartifacts = \"\"\"s3://\\\r\n  lab\"\"\"\r\n[run]\r\nworkers = 2\r\n",
            "\u{feff}storage.catalog = \"postgres://me@db/lab\"\n",
            "[storage]\ncatalog = [\"postgres://me@db/lab\"]\n",
            "[storage]\ncatalog = \"postgres://me@db/lab\"\nnot valid\n",
            "[storage]\ncatalog = \"postgres://me@db/lab\u{1b}\"\n",
            "[storage]\rcatalog = \"postgres://me@db/lab\"\n",
        ] {
            let local = make_local(text.as_bytes());
            assert!(!local.removed.is_empty(), "{text}");
            for line in local.text.lines().filter(|line| !line.starts_with('#')) {
                assert!(!line.contains("://"), "{text:?}: {:?}", local.text);
            }
            local.text.parse::<toml::Table>().expect("valid TOML");
        }
        let invalid = make_local(b"[storage]\ncatalog = \"postgres://\xff\"\n");
        assert_eq!(invalid.removed, ["storage.catalog"]);
    }
}

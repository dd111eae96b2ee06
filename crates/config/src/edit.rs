//! Changes one setting in the text of a settings file and keeps everything else, with its comments.

use toml::{Table, Value};

use super::error::{ConfigError, Origin};
use super::sources::parse;

/// Returns the text of a settings file in which a setting has another value.
///
/// # Errors
/// Returns an error if the file is not TOML, or if its form does not allow this without losing something.
pub fn with_setting(
    text: &str,
    key: &str,
    value: &Value,
    origin: &Origin,
) -> Result<String, ConfigError> {
    let mut wanted = parse(text, origin)?;
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    let edited = edited(text, section, name, value);
    let is_set = set(&mut wanted, key, value.clone()).is_some();
    if is_set && parse(&edited, origin).is_ok_and(|found| found == wanted) {
        return Ok(edited);
    }
    Err(ConfigError::Layer {
        origin: origin.clone(),
        problem: format!(
            "{key} cannot be changed here because of the form of the file; write {name} = {value} into it"
        ),
    })
}

/// Sets a value in a table. Returns `None` if the path leads through something that is not a table.
fn set(table: &mut Table, key: &str, value: Value) -> Option<()> {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
            Some(())
        }
        Some((first, rest)) => {
            let inner = table.entry(first).or_insert_with(|| Table::new().into());
            set(inner.as_table_mut()?, rest, value)
        }
    }
}

/// Replaces the line of the setting, or adds one below the header of its section, or at the end.
fn edited(text: &str, section: &str, name: &str, value: &Value) -> String {
    let mut line = format!("{name} = {value}");
    let mut lines: Vec<&str> = text.lines().collect();
    let header = |line: &str| {
        let line = line.trim().strip_prefix('[')?;
        Some(line.split(']').next().unwrap_or_default().trim().to_owned())
    };
    let is_setting = |line: &str| {
        let named = line.trim().strip_prefix(name);
        named.is_some_and(|rest| rest.trim_start().starts_with('='))
    };
    let start = lines
        .iter()
        .position(|line| header(line).as_deref() == Some(section));
    if let Some(start) = start {
        let inside = lines[start + 1..]
            .iter()
            .take_while(|line| header(line).is_none());
        let place = inside.clone().position(|line| is_setting(line));
        match place {
            Some(place) => {
                line += comment_of(lines[start + 1 + place]);
                lines[start + 1 + place] = &line;
            }
            None => lines.insert(start + 1, &line),
        }
        return lines.join("\n") + "\n";
    }
    let gap = if lines.is_empty() { "" } else { "\n" };
    let text = lines.join("\n");
    let end = if text.is_empty() { "" } else { "\n" };
    format!("{text}{end}{gap}[{section}]\n{line}\n")
}

/// Returns the comment behind a value, with the white space before it; empty if there is none.
fn comment_of(line: &str) -> &str {
    let is_whole = |end: usize| line[..end].parse::<Table>().is_ok();
    let start = line
        .match_indices('#')
        .map(|(at, _)| at)
        .find(|at| is_whole(*at));
    start.map_or("", |at| &line[line[..at].trim_end().len()..])
}

#[cfg(test)]
mod tests {
    use super::with_setting;
    use crate::Origin;

    fn with(text: &str, key: &str, value: impl Into<toml::Value>) -> Result<String, String> {
        with_setting(text, key, &value.into(), &Origin::Flag).map_err(|error| error.to_string())
    }

    #[test]
    fn a_setting_is_changed_or_added_and_comments_stay() {
        let text = "# mine\npreset = \"paper\"\n\n[run] # speed\nworkers = 2 # two\n# last\n[fit]\nseed = 1\n";
        let changed = with(text, "run.workers", 4).expect("changed");
        assert_eq!(changed, text.replace("workers = 2", "workers = 4"));
        let added = with(text, "run.memory_mib", 512).expect("added");
        assert!(
            added.contains("[run] # speed\nmemory_mib = 512\nworkers = 2"),
            "{added}"
        );
        let section = with(text, "limits.mesh.max_bytes", 7).expect("added");
        assert!(
            section.ends_with("\n\n[limits.mesh]\nmax_bytes = 7\n"),
            "{section}"
        );
        let sharp = "[fit]\nside = \"#1\"  # a # b\n";
        let changed = with(sharp, "fit.side", "auto").expect("changed");
        assert_eq!(changed, sharp.replace("#1", "auto"));
        let new = with("", "fit.side", "auto").expect("added");
        assert_eq!(new, "[fit]\nside = \"auto\"\n");
    }

    #[test]
    fn a_file_whose_form_would_lose_something_is_refused() {
        for text in ["[run]\nworkers = [\n1,\n2]\n", "run = { workers = 2 }\n"] {
            with(text, "run.workers", 4).expect_err("refused");
        }
    }
}

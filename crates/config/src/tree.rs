//! Layers of settings merged as TOML tables, each value with its origin.

use std::collections::BTreeMap;

use toml::{Table, Value};

use super::error::{ConfigError, Origin, quote};
use mocban_core::domain::spelling::hint;

/// A table with names of the user's choice.
const ROOTS: &str = "storage.roots";

/// The merged settings. `changed` maps the dotted key of each changed setting to the layer that changed it.
#[derive(Debug, Clone)]
pub struct Tree {
    root: Table,
    changed: BTreeMap<String, Origin>,
}

/// The value of one setting in one layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Dotted key, such as `run.workers`.
    pub key: String,
    /// The value.
    pub value: Value,
    /// The layer.
    pub origin: Origin,
}

impl Setting {
    /// Refuses the value.
    pub(super) fn invalid(&self, reason: &str) -> ConfigError {
        self.refused(&format!(": {}", quote(reason)))
    }

    /// Refuses the value with a text that follows `key = value`.
    pub(super) fn refused(&self, why: &str) -> ConfigError {
        ConfigError::Layer {
            origin: self.origin.clone(),
            problem: format!(
                "{} = {}{why}",
                quote(&self.key),
                quote(&self.value.to_string())
            ),
        }
    }
}

impl Tree {
    /// Starts with the lowest layer, which defines the sections and keys.
    pub const fn new(defaults: Table) -> Self {
        Self {
            root: defaults,
            changed: BTreeMap::new(),
        }
    }

    /// Returns the merged table.
    pub const fn table(&self) -> &Table {
        &self.root
    }

    /// Returns the changes that a layer's table makes, one per key.
    ///
    /// A table below the top level changes one setting per key if the defaults contain all of its keys. Otherwise the
    /// whole table is one value, such as an enum variant with data (`{ fixed = 127 }`).
    ///
    /// # Errors
    /// Returns an error if the layer names a section or key that does not exist, or sets a top-level section to a
    /// single value.
    pub fn changes(&self, layer: &Table, origin: &Origin) -> Result<Vec<Setting>, ConfigError> {
        let mut changes = Vec::new();
        collect(&self.root, layer, "", origin, &mut changes)?;
        Ok(changes)
    }

    /// Returns the changes that setting one dotted key makes. If the value is a table, it can set several keys.
    ///
    /// # Errors
    /// Returns an error if there is no such key, or if a top-level section is set to a single value.
    pub fn change(
        &self,
        key: &str,
        value: Value,
        origin: &Origin,
    ) -> Result<Vec<Setting>, ConfigError> {
        let mut layer = value;
        for part in key.rsplit('.') {
            layer = Value::Table(Table::from_iter([(part.to_owned(), layer)]));
        }
        match layer {
            Value::Table(table) => self.changes(&table, origin),
            other => self.changes(&Table::from_iter([(key.to_owned(), other)]), origin),
        }
    }

    /// Applies one change.
    pub fn apply(&mut self, change: &Setting) {
        let mut parts: Vec<&str> = change.key.split('.').collect();
        let Some(last) = parts.pop() else { return };
        let mut table = &mut self.root;
        for part in parts {
            match table.get_mut(part) {
                Some(Value::Table(inner)) => table = inner,
                Some(_) | None => return,
            }
        }
        match (table.get_mut(last), &change.value) {
            // Layers add names to these tables.
            (Some(Value::Table(names)), Value::Table(more)) if change.key == ROOTS => {
                names.extend(more.clone());
            }
            _ => {
                table.insert(last.to_owned(), change.value.clone());
            }
        }
        self.changed
            .retain(|key, _| !key.starts_with(&format!("{}.", change.key)));
        self.changed
            .insert(change.key.clone(), change.origin.clone());
    }

    /// Returns every value with its origin, in the order of the defaults.
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = Vec::new();
        flatten(&self.root, "", &mut |key, value| {
            settings.push(Setting {
                origin: self.origin(&key),
                key,
                value: value.clone(),
            });
        });
        settings
    }

    /// Returns the layer that set a key, or set the table that contains it.
    pub fn origin(&self, key: &str) -> Origin {
        let mut key = key;
        loop {
            if let Some(origin) = self.changed.get(key) {
                return origin.clone();
            }
            match key.rsplit_once('.') {
                Some((parent, _)) => key = parent,
                None => return Origin::Default,
            }
        }
    }
}

fn dotted(prefix: &str, key: &str) -> String {
    if prefix.is_empty() {
        key.to_owned()
    } else {
        format!("{prefix}.{key}")
    }
}

/// Passes each value that is not a table with content to `visit`, with its dotted key.
pub(super) fn flatten(table: &Table, prefix: &str, visit: &mut impl FnMut(String, &Value)) {
    for (key, value) in table {
        match value {
            Value::Table(inner) if !inner.is_empty() => flatten(inner, &dotted(prefix, key), visit),
            _ => visit(dotted(prefix, key), value),
        }
    }
}

fn collect(
    known: &Table,
    layer: &Table,
    prefix: &str,
    origin: &Origin,
    changes: &mut Vec<Setting>,
) -> Result<(), ConfigError> {
    for (key, value) in layer {
        let path = dotted(prefix, key);
        let Some(default) = known.get(key) else {
            let hint = hint(key, known.keys().map(String::as_str));
            return Err(ConfigError::Layer {
                origin: origin.clone(),
                problem: format!("there is no setting {}{hint}", quote(&path)),
            });
        };
        match (default, value) {
            (Value::Table(section), Value::Table(inner)) if is_section(prefix, section, inner) => {
                collect(section, inner, &path, origin, changes)?;
            }
            (Value::Table(_), _) if prefix.is_empty() => {
                return Err(ConfigError::Layer {
                    origin: origin.clone(),
                    problem: format!("{} is a section; set its keys one by one", quote(&path)),
                });
            }
            _ => changes.push(Setting {
                key: path,
                value: value.clone(),
                origin: origin.clone(),
            }),
        }
    }
    Ok(())
}

/// Returns whether a table of a layer is a section. A top-level table is always a section, so that a mistyped key is
/// reported by name. Any other table is a section only if all of its keys are known.
fn is_section(prefix: &str, section: &Table, layer: &Table) -> bool {
    prefix.is_empty() || layer.keys().all(|key| section.contains_key(key))
}

#[cfg(test)]
mod tests {
    use super::{Origin, Tree};

    fn tree() -> Tree {
        Tree::new(
            "[run]\nworkers = 0\n[fit]\nink = { fixed = 100 }\nside = \"auto\""
                .parse()
                .expect("valid"),
        )
    }

    fn apply(tree: &mut Tree, text: &str, origin: &Origin) {
        let layer = text.parse().expect("valid");
        for change in tree.changes(&layer, origin).expect("known keys") {
            tree.apply(&change);
        }
    }

    #[test]
    fn later_layer_wins_and_its_origin_is_recorded() {
        let mut tree = tree();
        apply(&mut tree, "run.workers = 2", &Origin::Preset("paper"));
        apply(&mut tree, "run.workers = 3", &Origin::Flag);
        assert_eq!(tree.table()["run"]["workers"].as_integer(), Some(3));
        assert_eq!(tree.origin("run.workers"), Origin::Flag);
        assert_eq!(tree.origin("fit.side"), Origin::Default);
    }

    #[test]
    fn enum_variant_with_data_is_replaced_as_one_value() {
        let mut tree = tree();
        apply(&mut tree, "fit.ink = { otsu = {} }", &Origin::Flag);
        assert!(tree.table()["fit"]["ink"].get("fixed").is_none());
        apply(&mut tree, "fit.ink = \"otsu\"", &Origin::Flag);
        assert_eq!(tree.table()["fit"]["ink"].as_str(), Some("otsu"));
    }

    #[test]
    fn unknown_key_is_reported_with_layer_and_suggestion() {
        let layer = "[run]\nwrokers = 1".parse().expect("valid");
        let error = tree()
            .changes(&layer, &Origin::File("p/mocban.toml".into()))
            .expect_err("no such key");
        assert_eq!(
            error.to_string(),
            "p/mocban.toml: there is no setting run.wrokers; did you mean \"workers\"?"
        );
    }

    #[test]
    fn value_in_place_of_a_section_is_refused() {
        let layer = "run = 1".parse().expect("valid");
        let error = tree().changes(&layer, &Origin::Flag).expect_err("refused");
        assert_eq!(
            error.to_string(),
            "--set: run is a section; set its keys one by one"
        );
    }
}

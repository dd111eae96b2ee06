//! Refuses passwords in addresses: settings are printed, and the file is copied into backups.

use toml::Value;

use super::error::ConfigError;
use super::tree::Setting;
use mocban_core::domain::has_password;

/// Settings that are addresses, and those below them.
const ADDRESSES: [&str; 3] = ["storage.catalog", "storage.artifacts", "storage.roots"];

/// Refuses an address with a password, without quoting it.
///
/// # Errors
/// Returns an error if the setting is an address with a password or a secret key.
pub(super) fn refuse(setting: &Setting) -> Result<(), ConfigError> {
    let key = &setting.key;
    let Some(known) = ADDRESSES.iter().find(|known| key.starts_with(**known)) else {
        return Ok(());
    };
    if !contains_password(&setting.value) {
        return Ok(());
    }
    let way_out = if *known == "storage.catalog" {
        "write the address without it, and put the password into ~/.pgpass or the variable PGPASSWORD"
    } else {
        "write the address without them, and put the keys into the variables AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"
    };
    Err(ConfigError::Layer {
        origin: setting.origin.clone(),
        problem: format!(
            "{known} contains a password or secret key, which `config show` would print and `backup` would copy; {way_out}"
        ),
    })
}

fn contains_password(value: &Value) -> bool {
    match value {
        Value::String(text) => has_password(text),
        Value::Array(values) => values.iter().any(contains_password),
        Value::Table(table) => table.values().any(contains_password),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use crate::{BaseLayer, Sources, load};

    #[test]
    fn an_address_with_a_password_is_refused_in_every_layer_and_not_quoted() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("mocban.toml");
        let write = |text: &str| std::fs::write(&file, text).expect("a small file");
        let catalog = "postgres://me:se-cret@db.example/lab";
        let of_file = Sources {
            base: BaseLayer::Project(file.clone()),
            ..Sources::default()
        };
        let of_variable = Sources {
            env: vec![("MOCBAN_STORAGE_CATALOG".to_owned(), catalog.to_owned())],
            ..Sources::default()
        };
        let of_flag = Sources {
            sets: vec![format!("storage.catalog={catalog}")],
            ..Sources::default()
        };
        for (text, sources, way_out) in [
            (
                &*format!("storage.catalog = '{catalog}'"),
                &of_file,
                "PGPASSWORD",
            ),
            (
                "storage.artifacts = 's3://A:se-cret@lab/x'",
                &of_file,
                "AWS_SECRET",
            ),
            (
                "storage.roots.scans = 's3://A:se-cret@lab'",
                &of_file,
                "AWS_SECRET",
            ),
            ("", &of_variable, "PGPASSWORD"),
            ("", &of_flag, "PGPASSWORD"),
        ] {
            write(text);
            let error = load(sources).expect_err("refused").to_string();
            assert!(error.contains(way_out), "{error}");
            assert!(!error.contains("se-cret"), "{error}");
        }
        write("storage.catalog = 'postgres://me@db.example/lab'");
        load(&of_file).expect("no password");
    }
}

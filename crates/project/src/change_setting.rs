//! Changes a setting in the file of a project, after saying what that costs.

use mocban_config::{Origin, Setting, with_setting};
use mocban_runner::fingerprints;
use mocban_store::{SETTINGS_FILE, TargetLock, write_atomic};

use crate::error::{ProjectError, ProjectResult, WithContext as _};
use crate::exit::Refusal;
use crate::files;
use crate::location::Location;
use crate::run::options;
use mocban_catalog::Catalog;

/// A setting that would be changed, and what follows.
#[derive(Debug)]
pub struct SettingChange {
    /// The setting as it is.
    pub before: Setting,
    /// The setting as it would be.
    pub after: Setting,
    /// Number of pairs that the next run would compute again, also for other reasons.
    pub stale: u64,
    /// Whether the next run would replace results by those of another method.
    pub changes_method: bool,
}

/// Looks at a change of a setting. `value` is written as in a settings file; text needs no quotes, and a number may have a
/// decimal comma, and a whole number signs between its groups of digits.
///
/// # Errors
/// Returns an error if there is no such setting, or its value is refused.
pub async fn preview(
    key: &str,
    value: &str,
    catalog: &Catalog,
    location: &Location,
) -> ProjectResult<SettingChange> {
    let current = location.settings()?;
    let find = |settings: Vec<Setting>| settings.into_iter().find(|setting| setting.key == key);
    let before = find(current.tree.settings());
    let before = before.ok_or_else(|| Refusal::Usage(format!("there is no setting {key}")))?;
    let mut changed = location.with_saved_settings();
    let value = if before.value.is_float() {
        value.replacen(',', ".", 1)
    } else if before.value.is_integer() {
        without_groups(value).unwrap_or_else(|| value.to_owned())
    } else {
        value.to_owned()
    };
    changed.sets = vec![format!("{key}={value}")];
    let changed = changed.settings()?;
    let after = find(changed.tree.settings()).unwrap_or_else(|| before.clone());
    let rerun = options(&changed.config).rerun;
    let current = fingerprints(&changed.config.stages);
    let plan = catalog.plan(&current, None, rerun).await?;
    Ok(SettingChange {
        before,
        after,
        stale: plan.again(),
        changes_method: plan.changes_method(),
    })
}

/// Returns a whole number such as `30.000.000`, `30,000,000` or `30 000 000` without the signs between its groups of three
/// digits. `None` if it has no such groups.
fn without_groups(value: &str) -> Option<String> {
    let mut groups = value.trim().split(['.', ',', ' ', '\u{a0}', '\u{202f}']);
    let first = groups.next()?;
    let others: Vec<&str> = groups.collect();
    let is_number = |group: &&str| group.bytes().all(|byte| byte.is_ascii_digit());
    let is_grouped = (1..=3).contains(&first.len())
        && is_number(&first)
        && !others.is_empty()
        && others
            .iter()
            .all(|group| group.len() == 3 && is_number(group));
    is_grouped.then(|| first.to_owned() + &others.concat())
}

/// Stores a change in the settings file of the project, which is created if there is none.
///
/// # Errors
/// Returns an error if the file cannot be written, or its form does not allow the change.
pub fn save(change: &SettingChange, location: &Location) -> ProjectResult<()> {
    let file = location.dir.join(SETTINGS_FILE);
    let failed = || format!("cannot write {}", file.display());
    let _lock = TargetLock::acquire(&file).with_context(failed)?;
    let text = files::small(&file)?.unwrap_or_default();
    let text = String::from_utf8(text)
        .map_err(|_invalid| ProjectError::unexpected(format!("{} is not UTF-8", file.display())))?;
    let origin = Origin::File(file.clone());
    let text = with_setting(&text, &change.after.key, &change.after.value, &origin)?;
    write_atomic(&file, text.as_bytes()).with_context(failed)?;
    // The settings of the environment are above the file.
    let stored = location.with_saved_settings().settings()?.tree.settings();
    let stored = stored
        .into_iter()
        .find(|setting| setting.key == change.after.key);
    match stored {
        Some(stored) if stored.value == change.after.value => Ok(()),
        _ => Err(Refusal::Usage(format!(
            "{} is saved, but an environment variable gives it another value",
            change.after.key
        ))
        .into()),
    }
}

#[cfg(test)]
mod tests {
    use super::without_groups;

    #[test]
    fn whole_numbers_may_have_groups_of_three_digits() {
        for text in [
            "30.000.000",
            "30,000,000",
            " 30 000 000",
            "30\u{202f}000\u{202f}000",
        ] {
            assert_eq!(without_groups(text).as_deref(), Some("30000000"), "{text}");
        }
        for other in [
            "30", "30.00", "3000.000", ".000", "a.000", "1.5e3", "", "-1.000",
        ] {
            assert_eq!(without_groups(other), None, "{other}");
        }
    }
}

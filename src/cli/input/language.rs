//! The language of pages, as the system gives it.

use mocban_pages::review::Language;

/// Returns Vietnamese if the locale is Vietnamese. Otherwise, the browser decides.
pub(crate) fn language_of_system() -> Option<Language> {
    let names = ["LC_ALL", "LC_MESSAGES", "LANG"];
    let set = names.iter().filter_map(|name| std::env::var(name).ok());
    let mut set = set.filter(|value| !value.is_empty());
    let locale = set.next()?;
    locale.starts_with("vi").then_some(Language::Vietnamese)
}

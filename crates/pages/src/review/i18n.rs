//! Messages of the page in English and Vietnamese.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use mocban_core::domain::enum_names;

/// The text of each message by language. The script replaces placeholders such as `{n}` by values.
static MESSAGES: LazyLock<BTreeMap<&str, BTreeMap<&str, &str>>> = LazyLock::new(|| {
    let text = include_str!("../../../../assets/review/messages.json");
    serde_json::from_str(text).expect("the messages are JSON without escapes")
});

/// A language of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// English.
    English,
    /// Vietnamese.
    Vietnamese,
}

impl Language {
    /// Returns the first supported language of an `Accept-Language` header, such as `vi-VN,vi;q=0.9,en;q=0.8`. Browsers list
    /// the preferred language first.
    pub(crate) fn accepted(header: &str) -> Option<Self> {
        let mut tags = header.split(',').map(str::trim);
        tags.find_map(|tag| {
            let end = tag.find(['-', ';']).unwrap_or(tag.len());
            tag[..end].to_ascii_lowercase().parse().ok()
        })
    }

    /// Returns the language that the query of an address asks for, such as `lang=vi`.
    pub(crate) fn asked_for(query: Option<&str>) -> Option<Self> {
        query?.strip_prefix("lang=")?.parse().ok()
    }

    /// Returns the other language.
    #[must_use]
    pub(crate) const fn other(self) -> Self {
        match self {
            Self::English => Self::Vietnamese,
            Self::Vietnamese => Self::English,
        }
    }

    /// Returns the message for a key, or the key itself if there is no message. A test checks that all messages exist.
    pub(crate) fn translate(self, key: &'static str) -> &'static str {
        MESSAGES.get(key).map_or(key, |texts| texts[self.name()])
    }

    /// Returns why an example of the guide passes or fails.
    pub(super) fn explanation(self, example: &str) -> &'static str {
        let texts = MESSAGES.get(format!("why_{example}").as_str());
        texts.map_or("", |texts| texts[self.name()])
    }

    /// Returns all messages by key, for the script.
    pub(super) fn messages(self) -> BTreeMap<&'static str, &'static str> {
        let messages = MESSAGES.iter();
        messages
            .map(|(key, texts)| (*key, texts[self.name()]))
            .collect()
    }
}

enum_names! { pub Language, "a language of the page": English = "en", Vietnamese = "vi" }

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Language, MESSAGES};
    use crate::review::{assets, keys};

    /// Returns the keys in calls such as `translate("pass")`.
    fn used(text: &str) -> impl Iterator<Item = &str> {
        let after = text.split("translate(\"").skip(1);
        after.map(|rest| rest.split('"').next().unwrap_or_default())
    }

    /// Returns the placeholders of a message, such as `{n}`.
    fn placeholders(text: &str) -> BTreeSet<&str> {
        let after = text.split('{').skip(1);
        after
            .map(|rest| rest.split_once('}').expect("a closed brace").0)
            .collect()
    }

    #[test]
    fn the_first_supported_language_of_the_browser_is_chosen() {
        for (header, language) in [
            ("vi-VN,vi;q=0.9,en;q=0.8", Some(Language::Vietnamese)),
            ("fr, EN-gb;q=0.8, vi;q=0.5", Some(Language::English)),
            ("vi", Some(Language::Vietnamese)),
            ("*", None),
            ("", None),
        ] {
            assert_eq!(Language::accepted(header), language, "{header}");
        }
    }

    #[test]
    fn an_address_asks_for_a_language() {
        for (query, language) in [
            (Some("lang=vi"), Some(Language::Vietnamese)),
            (Some("lang=en"), Some(Language::English)),
            (Some("lang=x"), None),
            (Some("language=vi"), None),
            (None, None),
        ] {
            assert_eq!(Language::asked_for(query), language, "{query:?}");
        }
    }

    #[test]
    fn messages_have_the_same_placeholders_in_both_languages() {
        for (key, texts) in MESSAGES.iter() {
            assert_eq!(texts.len(), Language::ALL.len(), "{key}");
            let [english, vietnamese] = Language::ALL.map(|language| texts[language.name()]);
            assert!(!english.is_empty() && !vietnamese.is_empty(), "{key}");
            assert_eq!(placeholders(english), placeholders(vietnamese), "{key}");
        }
        let lines = include_str!("../../../../assets/review/messages.json").lines();
        let keys = lines.filter(|line| line.starts_with("  \""));
        assert_eq!(keys.count(), MESSAGES.len(), "a key is there twice");
    }

    #[test]
    fn every_key_that_is_used_has_a_message() {
        let mut wanted: Vec<&str> = used(include_str!("page.rs")).collect();
        wanted.extend(used(include_str!("page_dialogs.rs")));
        wanted.extend(assets::scripts().flat_map(used));
        assert!(wanted.len() > 60, "{}", wanted.len());
        wanted.extend(keys::actions());
        for key in wanted {
            assert!(MESSAGES.contains_key(key), "{key}");
        }
        assert_eq!(Language::Vietnamese.translate("pass"), "Đạt");
    }
}

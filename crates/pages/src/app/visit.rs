//! One request for a page: its language, and its place among the pages, from which links are relative.

use std::convert::Infallible;
use std::sync::Arc;

use axum::extract::FromRequestParts;
use axum::http::header;
use axum::http::request::Parts;

use super::address::PageQuery;
use super::number_text;
use super::read_only::{ReadOnlyPlace, project_of};
use super::state::AppState;
use crate::local_server::AccessControl;
use crate::review::Language;
use mocban_core::domain::UnixMillis;

/// A request for a page.
#[derive(Debug, Clone)]
pub(super) struct Visit {
    pub(super) language: Language,
    /// Relative path of the home page, which ends with a slash.
    pub(super) root: String,
    /// Relative address of this page without its query.
    pub(super) here: String,
    pub(super) query: PageQuery,
    /// The token that actions must carry.
    pub(super) csrf_token: String,
    /// The place that actions of the page would write to, if they cannot.
    pub(super) read_only: Option<ReadOnlyPlace>,
}

impl Visit {
    /// Returns the visit of a page at the root without a query.
    #[cfg(test)]
    pub(super) fn in_language(language: Language) -> Self {
        Self {
            language,
            root: "./".to_owned(),
            here: "./".to_owned(),
            query: PageQuery::default(),
            csrf_token: String::new(),
            read_only: None,
        }
    }

    /// Returns the text in the language of the page.
    pub(super) const fn t<'t>(&self, english: &'t str, vietnamese: &'t str) -> &'t str {
        match self.language {
            Language::English => english,
            Language::Vietnamese => vietnamese,
        }
    }

    /// Returns the word for a number of things. English has a form for one.
    pub(super) const fn form<'t>(
        &self,
        number: u64,
        english: [&'t str; 2],
        vietnamese: &'t str,
    ) -> &'t str {
        self.t(number_text::english_form(number, english), vietnamese)
    }

    /// Returns the position of the language of the page in texts with one entry per language.
    pub(super) const fn index(&self) -> usize {
        match self.language {
            Language::English => 0,
            Language::Vietnamese => 1,
        }
    }

    /// Returns a number with some digits behind the decimal sign of the language.
    pub(super) fn decimal(&self, value: f64, digits: usize) -> String {
        number_text::decimal(self.language, value, digits)
    }

    /// Returns a number of bytes in the unit that fits.
    pub(super) fn file_size(&self, bytes: u64) -> String {
        number_text::file_size(self.language, bytes)
    }

    /// Returns a time in the time zone of the computer, written as in the language.
    pub(super) fn time(&self, at: UnixMillis) -> String {
        number_text::date_and_time(self.language, at)
    }

    /// Returns a duration in milliseconds in the unit that fits.
    pub(super) fn duration(&self, ms: u64) -> String {
        number_text::duration(self.language, ms)
    }

    /// Returns the relative address of a page of a project.
    pub(super) fn project_page(&self, key: &str, page: &str) -> String {
        format!("{}p/{}/{page}", self.root, super::address::encoded(key))
    }
}

impl FromRequestParts<Arc<AppState>> for Visit {
    type Rejection = Infallible;

    async fn from_request_parts(
        parts: &mut Parts,
        state: &Arc<AppState>,
    ) -> Result<Self, Self::Rejection> {
        let visit = Self::of(parts, state);
        let of_path = project_of(parts, state).await;
        let project = of_path.as_deref().or_else(|| visit.query.get("project"));
        let read_only = ReadOnlyPlace::find(state, project).await;
        Ok(Self { read_only, ..visit })
    }
}

impl Visit {
    /// Returns the visit of a request, without looking whether its place is read-only.
    pub(super) fn of(parts: &Parts, state: &AppState) -> Self {
        let path = parts.uri.path();
        let query = PageQuery::parse(parts.uri.query().unwrap_or_default());
        if let Some(chosen) = query.parsed("language") {
            state.set_language(chosen);
        }
        let accepted = parts.headers.get(header::ACCEPT_LANGUAGE);
        let of_browser = accepted.and_then(|value| Language::accepted(value.to_str().ok()?));
        let language = state.language().or(of_browser);
        let depth = path.matches('/').count().saturating_sub(1);
        let root = if depth == 0 {
            "./".to_owned()
        } else {
            "../".repeat(depth)
        };
        let here = path.rsplit('/').next().unwrap_or_default();
        let access = parts.extensions.get::<Arc<AccessControl>>();
        Self {
            language: language.unwrap_or(Language::English),
            root,
            here: if here.is_empty() {
                "./".to_owned()
            } else {
                here.to_owned()
            },
            query: query.with("language", ""),
            csrf_token: access.map_or_else(String::new, |access| access.csrf_token().to_owned()),
            read_only: None,
        }
    }
}

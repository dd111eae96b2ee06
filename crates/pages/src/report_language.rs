//! The HTML report in the language of a page.

use crate::messages::vietnamese_report;
use crate::review::Language;

/// Returns an HTML report in a language. It is made in English, and what is not known stays so.
pub fn report_page(page: String, language: Language) -> String {
    match language {
        Language::English => page,
        Language::Vietnamese => vietnamese_report(&page),
    }
}

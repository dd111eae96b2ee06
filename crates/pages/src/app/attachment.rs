//! Responses that a browser saves as files.

use axum::http::header;
use axum::response::{IntoResponse as _, Response};

use super::address::encoded;

/// Longest name of a file, in bytes.
const MAX_BYTES: usize = 255;

/// Returns a response that a browser saves as a file.
pub(super) fn attachment(file: &str, kind: &'static str, bytes: Vec<u8>) -> Response {
    let headers = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::CONTENT_DISPOSITION, disposition(file)),
    ];
    (headers, bytes).into_response()
}

/// Returns the value of the header that names a file. The name has only characters that every file system stores. Programs
/// that do not know RFC 5987 get a name in ASCII.
pub(super) fn disposition(file: &str) -> String {
    let name = safe_name(file);
    let ascii = |c: char| if c.is_ascii() { c } else { '_' };
    let plain: String = name.chars().map(ascii).collect();
    format!(
        "attachment; filename=\"{plain}\"; filename*=UTF-8''{}",
        encoded(&name)
    )
}

/// Returns a name without characters that some file system refuses, shortened before its extension if it is too long.
pub(super) fn safe_name(file: &str) -> String {
    let is_refused = |c: char| c.is_control() || r#"/\:*?"<>|"#.contains(c);
    let name = file.replace(is_refused, "-");
    let name = name.trim_start_matches('.');
    let (stem, extension) = match name.rsplit_once('.') {
        Some((stem, extension)) if extension.len() < MAX_BYTES => (stem, format!(".{extension}")),
        _ => (name, String::new()),
    };
    let end = stem.floor_char_boundary(MAX_BYTES - extension.len());
    format!("{}{extension}", &stem[..end])
}

#[cfg(test)]
mod tests {
    use super::{disposition, safe_name};

    #[test]
    fn names_are_safe_and_vietnamese_letters_stay() {
        assert_eq!(
            disposition("bản khắc-web.zip"),
            "attachment; filename=\"b_n kh_c-web.zip\"; filename*=UTF-8''b%E1%BA%A3n%20kh%E1%BA%AFc-web.zip"
        );
        assert_eq!(safe_name("a/b:\"c\"\r\n.zip"), "a-b--c---.zip");
        assert_eq!(safe_name("../.x"), "-.x");
        let long = safe_name(&format!("{}.zip", "ữ".repeat(200)));
        assert!(long.len() <= 255 && long.ends_with("ữ.zip"), "{long}");
        assert_eq!(safe_name("README"), "README");
    }
}

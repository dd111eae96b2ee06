//! Reasons of the operating system have Vietnamese texts.

use std::io;

use super::super::system_messages::SYSTEM_MESSAGES;
use super::vietnamese;

/// Numbers of errors that Linux and macOS share.
const SHARED: [i32; 18] = [
    1, 2, 5, 6, 12, 13, 16, 17, 18, 19, 20, 21, 22, 23, 24, 27, 28, 30,
];

#[test]
fn reasons_of_the_system_are_translated_with_the_place_before_them() {
    for number in SHARED {
        let error = io::Error::from_raw_os_error(number);
        let text = vietnamese(&error.to_string()).unwrap_or_default();
        let mut known = SYSTEM_MESSAGES.iter();
        assert!(
            known.any(|(_, translated)| *translated == text),
            "{error}: {text:?}"
        );
        let placed = vietnamese(&format!("/p/exports: {error}"));
        assert_eq!(placed, Some(format!("/p/exports: {text}")));
    }
}

#[test]
fn every_reason_has_one_text() {
    let mut names: Vec<&str> = SYSTEM_MESSAGES.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    let twice = names.windows(2).find(|names| names[0] == names[1]);
    assert_eq!(twice, None);
}

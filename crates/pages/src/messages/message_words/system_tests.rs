//! Reasons of the operating system have Vietnamese texts.

use std::io;

use super::super::system_messages::{SYSTEM_MESSAGES, reason_of_kind};
use super::vietnamese;

/// All kinds of errors that the standard library names, without those for errors of programs.
const KINDS: [io::ErrorKind; 38] = [
    io::ErrorKind::AddrInUse,
    io::ErrorKind::AddrNotAvailable,
    io::ErrorKind::AlreadyExists,
    io::ErrorKind::ArgumentListTooLong,
    io::ErrorKind::BrokenPipe,
    io::ErrorKind::ConnectionAborted,
    io::ErrorKind::ConnectionRefused,
    io::ErrorKind::ConnectionReset,
    io::ErrorKind::CrossesDevices,
    io::ErrorKind::Deadlock,
    io::ErrorKind::DirectoryNotEmpty,
    io::ErrorKind::ExecutableFileBusy,
    io::ErrorKind::FileTooLarge,
    io::ErrorKind::HostUnreachable,
    io::ErrorKind::Interrupted,
    io::ErrorKind::InvalidData,
    io::ErrorKind::InvalidFilename,
    io::ErrorKind::InvalidInput,
    io::ErrorKind::IsADirectory,
    io::ErrorKind::NetworkDown,
    io::ErrorKind::NetworkUnreachable,
    io::ErrorKind::NotADirectory,
    io::ErrorKind::NotConnected,
    io::ErrorKind::NotFound,
    io::ErrorKind::NotSeekable,
    io::ErrorKind::OutOfMemory,
    io::ErrorKind::PermissionDenied,
    io::ErrorKind::QuotaExceeded,
    io::ErrorKind::ReadOnlyFilesystem,
    io::ErrorKind::ResourceBusy,
    io::ErrorKind::StaleNetworkFileHandle,
    io::ErrorKind::StorageFull,
    io::ErrorKind::TimedOut,
    io::ErrorKind::TooManyLinks,
    io::ErrorKind::UnexpectedEof,
    io::ErrorKind::Unsupported,
    io::ErrorKind::WouldBlock,
    io::ErrorKind::WriteZero,
];

/// Numbers of errors that Linux and macOS share.
#[cfg(unix)]
const SHARED: [i32; 18] = [
    1, 2, 5, 6, 12, 13, 16, 17, 18, 19, 20, 21, 22, 23, 24, 27, 28, 30,
];

#[cfg(unix)]
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
fn every_kind_of_errors_is_translated() {
    for kind in KINDS {
        let text = reason_of_kind(kind);
        assert!(text.is_some(), "{kind:?}: {kind}");
        let error = io::Error::from(kind);
        assert_eq!(vietnamese(&error.to_string()).as_deref(), text, "{kind:?}");
    }
    assert_eq!(reason_of_kind(io::ErrorKind::Other), None);
}

#[test]
fn reasons_of_windows_are_translated_with_the_place_before_them() {
    for (english, expected) in [
        (
            "cannot read a.stl: The system cannot find the file specified. (os error 2)",
            "không đọc được a.stl: không có tệp này",
        ),
        (
            "p\\exports: Access is denied. (os error 5)",
            "p\\exports: không có quyền",
        ),
        (
            "The process cannot access the file because it is being used by another process. (os error 32)",
            "đang được chương trình khác dùng",
        ),
        (
            "b.png: There is not enough space on the disk. (os error 112)",
            "b.png: đĩa đã đầy",
        ),
    ] {
        assert_eq!(vietnamese(english).as_deref(), Some(expected));
    }
}

/// Tests the number of an error with a kind and words that no row has.
#[cfg(unix)]
#[test]
fn a_reason_with_unknown_words_is_translated_by_its_kind() {
    const EINTR: i32 = 4;
    let error = io::Error::from_raw_os_error(EINTR);
    assert_eq!(
        vietnamese(&format!("/p/exports: {error}")).as_deref(),
        Some("/p/exports: thao tác bị gián đoạn")
    );
    // Another number than that of the words.
    let other = "/p/exports: Interrupted here (os error 4)";
    assert_eq!(vietnamese(other), None);
}

#[test]
fn every_reason_has_one_text() {
    let mut names: Vec<&str> = SYSTEM_MESSAGES.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    let twice = names.windows(2).find(|names| names[0] == names[1]);
    assert_eq!(twice, None);
}

//! Uploads that begin at once, that are stored, and that end after a panic.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Barrier};
use std::time::Instant;

use super::{ArrivedFile, MAX_OPEN, Uploads};
use crate::app::failure::AppResult;
use crate::app::file_upload::{MAX_KEPT, MAX_SILENT, UploadEnding, UploadState};
use crate::app::upload_sentence::cut;
use mocban_core::domain::cancel::CancelToken;

#[test]
fn an_upload_is_not_cancelled_while_it_is_stored_and_ends_after_a_panic() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin("x".to_owned(), 1, 1).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    let received = upload.take(UploadState::Storing).expect("ready");
    upload.cancel().expect_err("it is stored");
    upload
        .take(UploadState::Storing)
        .expect_err("it is stored already");
    assert!(!upload.is_over());
    drop(received);
    drop(UploadEnding::of(Arc::clone(&upload)));
    assert!(upload.is_over(), "its place is free");
    upload.cancel().expect("nothing to do");
}

/// Begins two uploads of one name at once.
fn begin_two(uploads: &Uploads) -> [AppResult<(u64, Vec<ArrivedFile>)>; 2] {
    let both = Barrier::new(2);
    std::thread::scope(|scope| {
        let begin = || {
            both.wait();
            uploads.begin("x".to_owned(), 1, 1)
        };
        [scope.spawn(begin), scope.spawn(begin)].map(|one| one.join().expect("no panic"))
    })
}

#[test]
fn two_uploads_of_one_name_that_begin_at_once_are_two() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let begun = begin_two(&uploads).map(|begun| begun.expect("begun"));
    let [(first, _), (second, _)] = &begun;
    assert_ne!(first, second);
    for (id, arrived) in &begun {
        assert!(arrived.is_empty());
        let received = uploads.find(*id).expect("an upload");
        received.take(UploadState::Storing).expect("its own files");
    }
}

#[test]
fn the_last_place_goes_to_one_of_two_that_begin_at_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    for _ in 1..MAX_OPEN {
        uploads.begin("y".to_owned(), 1, 1).expect("a place");
    }
    let begun = begin_two(&uploads).map(|begun| begun.is_ok());
    assert!(begun[0] != begun[1], "{begun:?}");
}

#[test]
fn an_interrupted_upload_is_resumed_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (interrupted, _) = uploads.begin("x".to_owned(), 1, 1).expect("begun");
    let upload = uploads.find(interrupted).expect("an upload");
    let received = upload.take(UploadState::Storing).expect("ready");
    *upload.lock() = UploadState::Paused(received, Instant::now(), cut());
    let begun = begin_two(&uploads).map(|begun| begun.expect("begun").0);
    assert_ne!(begun[0], begun[1]);
    assert!(begun.contains(&interrupted), "{begun:?}");
}

/// Begins an upload that was interrupted at this time.
fn interrupted(uploads: &Uploads, name: &str, since: Instant) -> u64 {
    let (id, _) = uploads.begin(name.to_owned(), 1, 1).expect("a place");
    let upload = uploads.find(id).expect("an upload");
    let received = upload.take(UploadState::Storing).expect("ready");
    *upload.lock() = UploadState::Paused(received, since, cut());
    id
}

#[test]
fn a_new_upload_takes_the_place_of_the_oldest_interrupted_one_alone() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let now = Instant::now();
    let ages = [2, 3, 1, 0];
    let ids = ages.map(|age| {
        interrupted(
            &uploads,
            &format!("interrupted {age}"),
            now + MAX_SILENT * age,
        )
    });
    uploads.begin("new".to_owned(), 1, 1).expect("a place");
    assert_eq!(
        ids.map(|id| uploads.find(id).is_ok()),
        [true, true, true, false]
    );
}

#[test]
fn files_are_not_sent_twice_while_their_first_upload_may_interrupt() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin("x".to_owned(), 2, 1).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    let _received = upload.take(UploadState::Busy(CancelToken::default()));
    let now = Instant::now();
    let later = now + MAX_SILENT * 2;
    upload.last_piece.set(Some(now));
    assert!(!upload.is_silent(later), "no file has arrived");
    upload.arrived.store(1, Ordering::Relaxed);
    assert!(upload.is_silent(later));
    assert!(!upload.is_silent(now), "files are arriving");
    let before = now.checked_sub(MAX_SILENT * 2);
    let before = before.expect("a computer that started earlier");
    upload.last_piece.set(Some(before));
    uploads.begin("x".to_owned(), 2, 1).expect_err("silent");
    uploads.begin("y".to_owned(), 2, 1).expect("other files");
    upload.last_piece.set(Some(later));
    uploads.begin("x".to_owned(), 2, 1).expect("another one");
    upload.last_piece.set(None);
    assert!(!upload.is_silent(later), "an archive is unpacked");
}

#[test]
fn files_of_an_interrupted_upload_are_removed_after_their_time() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let now = Instant::now();
    let upload = uploads
        .find(interrupted(&uploads, "x", now))
        .expect("an upload");
    assert!(!upload.end_if_left(now + MAX_KEPT));
    assert!(upload.paused_since().is_some());
    assert!(upload.end_if_left(now + MAX_KEPT * 2));
    assert!(matches!(*upload.lock(), UploadState::Ended(None)));
    assert!(upload.end_if_left(now), "nothing is left to remove");
}

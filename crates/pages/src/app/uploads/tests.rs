//! Uploads that begin at once, that are stored, and that end after a panic.

use std::sync::{Arc, Barrier};
use std::time::Instant;

use super::{ArrivedFile, MAX_OPEN, UploadEnding, UploadState, Uploads};
use crate::app::failure::AppResult;
use crate::app::upload_sentence::cut;

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
fn an_upload_that_broke_off_goes_on_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (broken, _) = uploads.begin("x".to_owned(), 1, 1).expect("begun");
    let upload = uploads.find(broken).expect("an upload");
    let received = upload.take(UploadState::Storing).expect("ready");
    *upload.lock() = UploadState::Broken(received, Instant::now(), cut());
    let begun = begin_two(&uploads).map(|begun| begun.expect("begun").0);
    assert_ne!(begun[0], begun[1]);
    assert!(begun.contains(&broken), "{begun:?}");
}

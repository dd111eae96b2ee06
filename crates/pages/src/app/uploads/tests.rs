//! Uploads that begin at once, that are stored, and that end after a panic.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Barrier};
use std::time::Instant;

use axum::body::Bytes;

use super::{ArrivedFile, FOLDER, MAX_OPEN, Uploads};
use crate::app::failure::AppResult;
use crate::app::file_upload::{
    AnnouncedFiles, FileUpload, MAX_KEPT, MAX_SILENT, UploadActivity, UploadEnding, UploadState,
};
use crate::app::received_files::FilePiece;
use crate::app::upload_sentence::{RESERVE_BYTES, cut, cut_with_rest, taken_over};
use crate::review::Language;
use mocban_core::domain::cancel::CancelToken;
use mocban_lists::workbook::test_helpers::archive;
use mocban_store::NewFolder;

/// Announces a file with this content.
fn files(content: &str) -> AnnouncedFiles {
    AnnouncedFiles {
        name: "x".to_owned(),
        content: content.to_owned(),
        files: 1,
        bytes: 1,
        project: String::new(),
        take_over: false,
    }
}

#[test]
fn an_upload_is_not_cancelled_while_it_is_stored_and_ends_after_a_panic() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin(&files("x")).expect("begun");
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

/// Sends a whole scan, and then these pieces of an archive. The page is closed at the gate, if there is one. `free_bytes` is called
/// before the archive is unpacked. Returns the upload once its thread has put back the files.
async fn closed_during(
    pieces: Vec<FilePiece>,
    free_bytes: fn(&Path) -> Option<u64>,
    gate: Option<&Barrier>,
) -> (tempfile::TempDir, Arc<FileUpload>) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let two = AnnouncedFiles {
        files: 2,
        ..files("x")
    };
    let (id, _) = uploads.begin(&two).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    let first = upload.start("1.stl", Some(1)).expect("ready");
    first.pass(FilePiece::End).await;
    first.finish().await.expect("an empty scan");
    if let UploadState::Ready(received, _) = &mut *upload.lock() {
        received.free_bytes = free_bytes;
    }
    let file = upload.start("2.zip", Some(1)).expect("ready");
    for piece in pieces {
        file.pass(piece).await;
    }
    {
        let settled = upload.settled.notified();
        tokio::pin!(settled);
        settled.as_mut().enable();
        let wait = || {
            if let Some(gate) = gate {
                gate.wait();
            }
        };
        wait();
        drop(file);
        wait();
        settled.await;
    }
    (dir, upload)
}

#[tokio::test]
async fn a_page_that_is_closed_while_an_archive_is_unpacked_loses_nothing() {
    static CLOSED: Barrier = Barrier::new(2);
    let whole = Bytes::from(archive(&[("3.stl", "solid")], true));
    let wait: fn(&Path) -> Option<u64> = |_| {
        CLOSED.wait();
        CLOSED.wait();
        None
    };
    let pieces = vec![FilePiece::Bytes(whole.clone()), FilePiece::End];
    let (_dir, upload) = closed_during(pieces, wait, Some(&CLOSED)).await;
    assert_eq!(upload.problem(), None);
    let placed = upload.finish().await.expect("both have arrived");
    for scan in ["1.stl", "3.stl"] {
        assert!(placed.join(scan).is_file(), "{scan}");
    }
}

#[tokio::test]
async fn a_page_that_is_closed_before_the_end_of_a_file_can_resume() {
    let pieces = vec![FilePiece::Bytes(Bytes::from_static(b"PK"))];
    let (_dir, upload) = closed_during(pieces, |_| None, None).await;
    assert_eq!(upload.problem(), Some(cut_with_rest(1)));
    let kept = upload.give_up().expect("the scan");
    assert_eq!(kept.arrived().len(), 1);
}

#[tokio::test]
async fn an_upload_whose_page_is_closed_between_two_files_is_resumed_at_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin(&files("x")).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    upload.pause();
    assert_eq!(upload.problem(), None, "nothing would be lost");
    let file = upload.start("1.stl", Some(1)).expect("it came back");
    file.pass(FilePiece::End).await;
    file.finish().await.expect("an empty scan");
    assert_eq!(upload.problem(), None);
    upload.pause();
    assert_eq!(uploads.problem(""), Some(cut_with_rest(1)));
    let (resumed, arrived) = uploads.begin(&files("x")).expect("resumed");
    assert_ne!(resumed, id);
    assert_eq!(arrived.len(), 1);
    let upload = uploads.find(resumed).expect("an upload");
    let file = upload.start("2.stl", Some(1)).expect("ready");
    upload.pause();
    file.pass(FilePiece::End).await;
    file.finish().await.expect("it has arrived");
    assert_eq!(upload.problem(), Some(cut_with_rest(2)));
}

#[tokio::test]
async fn an_upload_whose_page_is_closed_can_be_cancelled_while_an_archive_is_unpacked() {
    static CANCELLED: Barrier = Barrier::new(2);
    let whole = Bytes::from(archive(&[("3.stl", "solid")], true));
    let wait: fn(&Path) -> Option<u64> = |_| {
        CANCELLED.wait();
        CANCELLED.wait();
        None
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin(&files("x")).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    if let UploadState::Ready(received, _) = &mut *upload.lock() {
        received.free_bytes = wait;
    }
    let file = upload.start("2.zip", Some(1)).expect("ready");
    file.pass(FilePiece::Bytes(whole)).await;
    file.pass(FilePiece::End).await;
    {
        let settled = upload.settled.notified();
        tokio::pin!(settled);
        settled.as_mut().enable();
        CANCELLED.wait();
        drop(file);
        upload.cancel().expect("it is not stored");
        CANCELLED.wait();
        settled.await;
    }
    assert!(upload.is_over());
    let left = std::fs::read_dir(uploads.folder()).expect("a folder");
    assert_eq!(left.count(), 0, "nothing is kept");
}

/// Begins two uploads of the same files at once.
fn begin_two(uploads: &Uploads, content: &str) -> [AppResult<(u64, Vec<ArrivedFile>)>; 2] {
    let both = Barrier::new(2);
    std::thread::scope(|scope| {
        let begin = || {
            both.wait();
            uploads.begin(&files(content))
        };
        [scope.spawn(begin), scope.spawn(begin)].map(|one| one.join().expect("no panic"))
    })
}

#[test]
fn of_two_uploads_of_the_same_files_that_begin_at_once_one_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let begun = begin_two(&uploads, "x").map(|begun| begun.is_ok());
    assert!(begun[0] != begun[1], "{begun:?}");
    uploads.begin(&files("y")).expect("other files");
    let unknown = begin_two(&uploads, "").map(|begun| begun.expect("begun").0);
    assert_ne!(unknown[0], unknown[1], "they may be different files");
}

#[test]
fn the_last_place_goes_to_one_of_two_that_begin_at_once() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    for _ in 1..MAX_OPEN {
        uploads.begin(&files("")).expect("a place");
    }
    let begun = begin_two(&uploads, "").map(|begun| begun.is_ok());
    assert!(begun[0] != begun[1], "{begun:?}");
}

#[test]
fn an_interrupted_upload_is_resumed_once_and_its_page_can_send_nothing_more() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let id = interrupted(&uploads, "x", Instant::now());
    let begun = begin_two(&uploads, "x").map(|begun| begun.ok().map(|(id, _)| id));
    let ([Some(resumed), None] | [None, Some(resumed)]) = begun else {
        unreachable!("one is refused: {begun:?}");
    };
    assert_ne!(resumed, id);
    let before = uploads.find(id).expect("a reason");
    before.take(UploadState::Storing).expect_err("taken over");
    assert_eq!(before.problem(), Some(taken_over()));
    // The first page cancels only what it began.
    before.cancel().expect("nothing to do");
    let after = uploads.find(resumed).expect("an upload");
    after.take(UploadState::Storing).expect("its files");
}

/// Begins an upload that was interrupted at this time.
fn interrupted(uploads: &Uploads, content: &str, since: Instant) -> u64 {
    let (id, _) = uploads.begin(&files(content)).expect("a place");
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
    uploads.begin(&files("new")).expect("a place");
    assert_eq!(
        ids.map(|id| uploads.find(id).is_ok()),
        [true, true, true, false]
    );
}

#[test]
fn interrupted_uploads_give_their_room_to_a_new_one_from_the_oldest_on() {
    // A disk on which an upload takes one byte, with room for three.
    let three: fn(&Path) -> Option<u64> = |dir| {
        let files = std::fs::read_dir(dir.join(FOLDER)).expect("a folder");
        let is_upload = |name: &str| NewFolder::is_unfinished(name.as_ref());
        let names = files.filter_map(|file| file.ok()?.file_name().into_string().ok());
        Some(RESERVE_BYTES + 3 - names.filter(|name| is_upload(name)).count() as u64)
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let mut uploads = Uploads::new(dir.path());
    let now = Instant::now();
    let ids = [2, 3, 1].map(|age| {
        let id = interrupted(&uploads, &format!("{age}"), now + MAX_SILENT * age);
        let upload = uploads.find(id).expect("an upload");
        upload.count.bytes.store(1, Ordering::Relaxed);
        id
    });
    uploads.free_bytes = three;
    let are_kept = |uploads: &Uploads| ids.map(|id| uploads.find(id).is_ok());
    let large = AnnouncedFiles {
        bytes: 4,
        ..files("large")
    };
    uploads.begin(&large).expect_err("it has never room");
    assert_eq!(are_kept(&uploads), [true; 3], "nothing is removed in vain");
    uploads.begin(&files("new")).expect("room");
    assert_eq!(are_kept(&uploads), [true, true, false]);
}

/// Returns an upload of which a file has arrived and another one arrives, on no thread.
fn busy(uploads: &Uploads, content: &str) -> Arc<FileUpload> {
    let (id, _) = uploads.begin(&files(content)).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    let arriving = UploadState::Busy(CancelToken::default(), None);
    let _received = upload.take(arriving).expect("ready");
    upload.arrived.store(1, Ordering::Relaxed);
    upload
}

#[test]
fn files_are_not_sent_twice_while_another_page_may_send_them() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let upload = busy(&uploads, "x");
    let now = Instant::now();
    let later = now + MAX_SILENT * 2;
    upload.last_piece.set(Some(now));
    assert_eq!(upload.activity(later), Some(UploadActivity::Silent));
    assert_eq!(upload.activity(now), Some(UploadActivity::Arriving));
    let refused = |content| {
        let begun = uploads.begin(&files(content)).expect_err("another page");
        begun.text(Language::English).to_owned()
    };
    assert!(refused("x").contains("wait for their end"));
    let before = now.checked_sub(MAX_SILENT * 2);
    let before = before.expect("a computer that started earlier");
    upload.last_piece.set(Some(before));
    assert!(refused("x").contains("Take over"));
    uploads.begin(&files("y")).expect("other files");
    upload.last_piece.set(None);
    let unpacking = Some(UploadActivity::Arriving);
    assert_eq!(upload.activity(later), unpacking, "an archive");
    upload.last_piece.set(Some(before));
    upload.arrived.store(0, Ordering::Relaxed);
    assert_eq!(upload.activity(later), None, "no file has arrived");
    uploads.begin(&files("x")).expect("nothing can be resumed");
}

#[tokio::test]
async fn an_upload_is_taken_over_only_while_nothing_of_it_arrives() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let (id, _) = uploads.begin(&files("x")).expect("begun");
    let upload = uploads.find(id).expect("an upload");
    upload.arrived.store(1, Ordering::Relaxed);
    uploads.interrupt_silent(&files("x")).await;
    uploads.begin(&files("x")).expect_err("files are arriving");
    let received = upload.take(UploadState::Storing).expect("ready");
    let before = Instant::now().checked_sub(MAX_SILENT * 2);
    let before = before.expect("a computer that started earlier");
    *upload.lock() = UploadState::Ready(received, before);
    uploads.begin(&files("x")).expect_err("it may come back");
    uploads.interrupt_silent(&files("y")).await;
    uploads.begin(&files("x")).expect_err("other files");
    uploads.interrupt_silent(&files("x")).await;
    let (taken, _) = uploads.begin(&files("x")).expect("taken over");
    assert_ne!(taken, id);
    assert_eq!(upload.problem(), Some(taken_over()));
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

/// Begins an upload for a project, which fails.
fn failed_for(uploads: &Uploads, project: &str) -> u64 {
    let files = AnnouncedFiles {
        project: project.to_owned(),
        ..files("")
    };
    let (id, _) = uploads.begin(&files).expect("a place");
    let upload = uploads.find(id).expect("an upload");
    *upload.lock() = UploadState::Ended(Some(cut()));
    id
}

#[test]
fn a_failed_upload_is_said_only_where_it_was_begun() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let uploads = Uploads::new(dir.path());
    let first = failed_for(&uploads, "a");
    assert_eq!(uploads.problem("a"), Some(cut()));
    for other in ["", "b"] {
        assert_eq!(uploads.problem(other), None, "{other:?}");
    }
    // An upload of another project keeps the reason, and the next one of the project removes it.
    failed_for(&uploads, "b");
    assert_eq!(uploads.problem("a"), Some(cut()));
    uploads.find(first).expect("its reason");
    failed_for(&uploads, "a");
    assert!(uploads.find(first).is_err());
    // Reasons take no place.
    for number in 0..MAX_OPEN {
        failed_for(&uploads, &number.to_string());
    }
    assert_eq!(uploads.problem("3"), Some(cut()));
}

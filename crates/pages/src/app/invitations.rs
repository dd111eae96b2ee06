//! Invitations to judge: a link each for other devices of the network. They end with the app.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use axum::Router;
use tokio::sync::Mutex;

use super::failure::{AppFailure, AppResult};
use super::open_pages::PagesId;
use super::projects::OpenProject;
use super::sentence::{Sentence, system_reasons};
use crate::local_server::{Guest, GuestServer, ServerError, network_address};
use crate::review::{QueueCounts, ReviewPages};
use mocban_core::domain::UnixMillis;
use mocban_project::error::without_error_numbers;
use mocban_project::location::now;

/// Most invitations at a time. Each has connections to the catalog, and keeps its queue in memory.
const LIMIT: usize = 16;

/// The invitations of the app. The server for guests starts with the first.
#[derive(Debug)]
pub(super) struct Invitations {
    /// Address at which guests reach this computer; `None` for its address in its network.
    listen: Option<IpAddr>,
    /// Name on which the port depends.
    name: String,
    sent: Mutex<SentInvitations>,
}

#[derive(Debug, Default)]
struct SentInvitations {
    guests: BTreeMap<PagesId, SentGuest>,
    server: Option<GuestServer>,
}

#[derive(Debug)]
struct SentGuest {
    guest: Guest,
    project: Arc<OpenProject>,
    review: Arc<GuestReview>,
}

/// The review of a guest, and when the guest was last seen.
#[derive(Debug)]
pub(super) struct GuestReview {
    pages: ReviewPages,
    /// Time of the last request; 0 if there was none.
    seen: AtomicI64,
}

impl GuestReview {
    pub(super) const fn new(pages: ReviewPages) -> Self {
        Self {
            pages,
            seen: AtomicI64::new(0),
        }
    }

    /// Notes a request of the guest.
    pub(super) fn see(&self) {
        self.seen.store(now(), Ordering::Relaxed);
    }
}

/// An invitation as the page shows it.
#[derive(Debug)]
pub(super) struct SentInvitation {
    pub(super) reviewer: String,
    pub(super) choice: String,
    /// `None` if it has been opened.
    pub(super) url: Option<String>,
    /// What the guest has answered. `None` if it cannot be read now.
    pub(super) progress: Option<QueueCounts>,
    /// When the guest was last seen.
    pub(super) seen: Option<UnixMillis>,
}

impl Invitations {
    /// Makes the invitations to projects of a folder. The port is the same for the same folder, so that a browser sends its
    /// unsaved answers after a restart.
    pub(super) fn new(listen: Option<IpAddr>, folder: &Path) -> Self {
        let whole = folder.canonicalize();
        let whole = whole.unwrap_or_else(|_| folder.to_owned());
        Self {
            listen,
            name: format!("{}\0guests", whole.display()),
            sent: Mutex::default(),
        }
    }

    /// Returns the invitations to a project, with what the guests have answered by now.
    pub(super) async fn of_project(&self, key: &str) -> Vec<SentInvitation> {
        let mut found = Vec::new();
        for ([of, reviewer, choice], sent) in &self.sent.lock().await.guests {
            if of == key {
                let seen = sent.review.seen.load(Ordering::Relaxed);
                let invitation = SentInvitation {
                    reviewer: reviewer.clone(),
                    choice: choice.clone(),
                    url: (!sent.guest.is_opened()).then(|| sent.guest.url()),
                    progress: None,
                    seen: (seen > 0).then_some(seen),
                };
                found.push((invitation, Arc::clone(&sent.review)));
            }
        }
        // The catalog may take long to answer, and invitations do not wait for it.
        let mut invitations = Vec::new();
        for (mut invitation, review) in found {
            invitation.progress = review.pages.progress().await.ok();
            invitations.push(invitation);
        }
        invitations
    }

    /// Returns whether an invitation was sent and not withdrawn, and if so, whether its link has been opened.
    pub(super) async fn is_opened(&self, id: &PagesId) -> Option<bool> {
        let sent = self.sent.lock().await;
        sent.guests.get(id).map(|sent| sent.guest.is_opened())
    }

    /// Refuses another invitation if there are too many.
    pub(super) async fn require_room(&self) -> AppResult<()> {
        let mut sent = self.sent.lock().await;
        if sent.guests.len() >= LIMIT {
            // Guests of a project that is not in its place judge nothing, and no page shows them.
            sent.guests.retain(|_, sent| sent.project.is_current());
        }
        if sent.guests.len() < LIMIT {
            return Ok(());
        }
        Err(AppFailure::refused(Sentence::new(
            format!("{LIMIT} people are invited: withdraw an invitation first"),
            format!("đã có {LIMIT} người được mời: trước hết hãy thu hồi một lời mời"),
        )))
    }

    /// Ends an invitation. Answers that were stored stay.
    pub(super) async fn withdraw(&self, id: &PagesId) {
        self.sent.lock().await.guests.remove(id);
    }

    /// Sends an invitation to `pages` of a project. `replaces` is whether only the link of an earlier one is replaced: then
    /// nothing is sent if that was withdrawn meanwhile.
    pub(super) async fn send(
        &self,
        id: PagesId,
        project: &Arc<OpenProject>,
        (pages, review): (Router, Arc<GuestReview>),
        replaces: bool,
    ) -> AppResult<()> {
        let mut sent = self.sent.lock().await;
        if replaces && !sent.guests.contains_key(&id) {
            return Ok(());
        }
        let address = self.listen.or_else(network_address).ok_or_else(|| {
            AppFailure::refused(Sentence::new(
                "no address of this computer was found: connect it to a network, or start the app with --listen and its address, such as 192.168.1.20",
                "không tìm thấy địa chỉ của máy này: hãy kết nối mạng, hoặc mở ứng dụng với --listen và địa chỉ của máy, ví dụ 192.168.1.20",
            ))
        })?;
        // In another network, nobody reaches the guests of the earlier address.
        if sent
            .server
            .as_ref()
            .is_some_and(|server| server.address().ip() != address)
        {
            sent.guests.clear();
            sent.server = None;
        }
        let server = match sent.server.take() {
            Some(server) => server,
            None => GuestServer::start(SocketAddr::new(address, 0), &self.name)
                .await
                .map_err(|error| refused(&error))?,
        };
        let guest = sent.server.insert(server).invite(&id.join("\0"), pages);
        let guest = guest.map_err(|error| refused(&error))?;
        let project = Arc::clone(project);
        let invited = SentGuest {
            guest,
            project,
            review,
        };
        sent.guests.insert(id, invited);
        Ok(())
    }
}

fn refused(error: &ServerError) -> AppFailure {
    let (what, source) = match error {
        ServerError::Listen { address, source } => {
            (format!("không mở được địa chỉ {}", address.ip()), source)
        }
        ServerError::Token(source) => ("không tạo được liên kết".to_owned(), source),
    };
    let [_, why] = system_reasons(source);
    let english = without_error_numbers(&error.to_string());
    AppFailure::refused(Sentence::new(english, format!("{what}: {why}")))
}

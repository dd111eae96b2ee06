//! Invitations to judge: a link each for other devices of the network. They end with the app.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::path::Path;

use axum::Router;
use tokio::sync::Mutex;

use super::failure::{AppFailure, AppResult};
use super::sentence::Sentence;
use crate::local_server::{Guest, GuestServer, ServerError, network_address};

/// Most invitations at a time. Each keeps its queue in memory.
const LIMIT: usize = 32;

/// Project, reviewer, and what is judged.
pub(super) type InvitationId = [String; 3];

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
    guests: BTreeMap<InvitationId, Guest>,
    server: Option<GuestServer>,
}

/// An invitation as the page shows it.
#[derive(Debug)]
pub(super) struct SentInvitation {
    pub(super) reviewer: String,
    pub(super) choice: String,
    /// `None` if it has been opened.
    pub(super) url: Option<String>,
}

impl Invitations {
    /// Makes the invitations to projects of a folder. The port is the same for the same folder, so that a browser sends its
    /// unsaved answers after a restart.
    pub(super) fn new(listen: Option<IpAddr>, folder: &Path) -> Self {
        Self {
            listen,
            name: format!("{}\0guests", folder.display()),
            sent: Mutex::default(),
        }
    }

    /// Returns the invitations to a project.
    pub(super) async fn of_project(&self, key: &str) -> Vec<SentInvitation> {
        let sent = self.sent.lock().await;
        let of_project = sent.guests.iter().filter(|([of, ..], _)| of == key);
        let invitation = |([_, reviewer, choice], guest): (&InvitationId, &Guest)| SentInvitation {
            reviewer: reviewer.clone(),
            choice: choice.clone(),
            url: (!guest.is_opened()).then(|| guest.url()),
        };
        of_project.map(invitation).collect()
    }

    /// Returns whether an invitation was sent and not withdrawn.
    pub(super) async fn is_sent(&self, id: &InvitationId) -> bool {
        self.sent.lock().await.guests.contains_key(id)
    }

    /// Sends an invitation to `pages`. An earlier one with the same id ends.
    pub(super) async fn send(&self, id: InvitationId, pages: Router) -> AppResult<()> {
        let mut sent = self.sent.lock().await;
        if sent.guests.len() >= LIMIT && !sent.guests.contains_key(&id) {
            return Err(AppFailure::refused(Sentence::new(
                format!("{LIMIT} people are invited: withdraw an invitation first"),
                format!("đã có {LIMIT} người được mời: trước hết hãy thu hồi một lời mời"),
            )));
        }
        let server = match sent.server.take() {
            Some(server) => server,
            None => self.start_server().await?,
        };
        let guest = sent.server.insert(server).invite(pages);
        sent.guests.insert(id, guest.map_err(refused)?);
        Ok(())
    }

    /// Ends an invitation. Answers that were stored stay.
    pub(super) async fn withdraw(&self, id: &InvitationId) {
        self.sent.lock().await.guests.remove(id);
    }

    async fn start_server(&self) -> AppResult<GuestServer> {
        let address = self.listen.or_else(network_address).ok_or_else(|| {
            AppFailure::refused(Sentence::new(
                "this computer is in no network: connect it, and try again",
                "máy tính này chưa vào mạng nào: hãy kết nối mạng rồi thử lại",
            ))
        })?;
        let server = GuestServer::start(SocketAddr::new(address, 0), &self.name).await;
        server.map_err(refused)
    }
}

fn refused(error: ServerError) -> AppFailure {
    AppFailure::refused(Sentence::of_program(&error.to_string()))
}

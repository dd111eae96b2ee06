//! A server for people who were invited. Each has a session of their own, which sees only the pages of the invitation.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use axum::extract::{Request, State};
use axum::http::Uri;
use axum::response::Response;
use axum::{Extension, Router};

use super::access_control::{AccessControl, Entrance};
use super::connection::ConnectionLimits;
use super::connections::serve;
use super::guarded_pages::{respond, start_token};
use super::server::{ServerError, bind};
use super::session::START;
use mocban_core::domain::ContentHash;
use mocban_core::locked;

/// Name of the cookies.
const COOKIE: &str = "guest";

/// A running server for guests. It ends when this value is dropped.
#[derive(Debug)]
pub struct GuestServer {
    address: SocketAddr,
    sessions: Arc<GuestSessions>,
    serving: tokio::task::AbortHandle,
}

/// The sessions of a server for guests.
#[derive(Debug)]
struct GuestSessions {
    /// Replies to requests that belong to no guest.
    nobody: Router,
    guests: Mutex<Vec<(Arc<AccessControl>, Router)>>,
}

/// A person who was invited.
#[derive(Debug)]
pub struct Guest {
    access: Arc<AccessControl>,
    sessions: Arc<GuestSessions>,
}

impl GuestServer {
    /// Binds an address and serves guests. Port 0 chooses the same port for equal names, if it is free.
    ///
    /// # Errors
    /// Returns an error if the address cannot be bound or the system provides no randomness.
    pub async fn start(address: SocketAddr, name: &str) -> Result<Self, ServerError> {
        let (listener, address) = bind(address, name).await?;
        // No link contains its token.
        let entrance = Entrance::Invitation {
            place: String::new(),
        };
        let nobody = AccessControl::new(COOKIE, address, entrance);
        let nobody = Arc::new(nobody.map_err(ServerError::Token)?);
        let sessions = Arc::new(GuestSessions {
            nobody: nobody.guarded(Router::new()),
            guests: Mutex::default(),
        });
        let router = Router::new()
            .fallback(of_guest)
            .with_state(Arc::clone(&sessions));
        let limits = ConnectionLimits::of_guests();
        let serving = tokio::spawn(serve(listener, router, limits, std::future::pending()));
        Ok(Self {
            address,
            sessions,
            serving: serving.abort_handle(),
        })
    }

    /// Returns the bound address.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns a new guest, whose session sees `pages` and nothing else. Guests of the same `name` have the same place.
    /// Handlers find the [`AccessControl`] as an extension.
    ///
    /// # Errors
    /// Returns an error if the system provides no randomness.
    pub fn invite(&self, name: &str, pages: Router) -> Result<Guest, ServerError> {
        let mut place = ContentHash::of(name.as_bytes()).to_hex();
        place.truncate(16);
        let access = AccessControl::new(COOKIE, self.address, Entrance::Invitation { place });
        let access = Arc::new(access.map_err(ServerError::Token)?);
        let router = access.guarded(pages.layer(Extension(Arc::clone(&access))));
        let guest = (Arc::clone(&access), router);
        locked(&self.sessions.guests).push(guest);
        Ok(Guest {
            access,
            sessions: Arc::clone(&self.sessions),
        })
    }
}

impl Drop for GuestServer {
    fn drop(&mut self) {
        self.serving.abort();
    }
}

impl Guest {
    /// Returns the link of the invitation, which opens the session once.
    pub fn url(&self) -> String {
        self.access.url()
    }

    /// Returns whether the link has been opened.
    pub fn is_opened(&self) -> bool {
        self.access.session.is_opened()
    }
}

impl Drop for Guest {
    /// Ends the session.
    fn drop(&mut self) {
        let mut guests = locked(&self.sessions.guests);
        guests.retain(|(access, _)| !Arc::ptr_eq(access, &self.access));
    }
}

impl GuestSessions {
    /// Returns the pages of the guest whose session a request names. The guard of these pages then asks for the cookie.
    fn pages(&self, uri: &Uri) -> Router {
        let guests = locked(&self.guests);
        let found = guests.iter().find(|(access, _)| {
            let session = &access.session;
            session.page(uri.path()).is_some()
                || (uri.path() == START && session.has_token(start_token(uri.query())))
        });
        found.map_or_else(|| self.nobody.clone(), |(_, pages)| pages.clone())
    }
}

async fn of_guest(State(sessions): State<Arc<GuestSessions>>, request: Request) -> Response {
    respond(sessions.pages(request.uri()), request).await
}

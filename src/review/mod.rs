//! The review page: a server on this machine where one reviewer judges results and lays reliefs by hand.
//!
//! [`open`] binds and reads the deck; [`Review::serve`] answers until it is told to stop. Every answer is on the disk
//! before its sender hears of it. What only tests the reviewer goes every step of the way as a result does.

mod answer;
mod assets;
mod card;
mod control;
mod correction;
mod deck;
mod desk;
mod guard;
mod keys;
mod known;
mod order;
mod page;
mod pictures;
mod routes;
mod session;
mod words;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use tokio::net::TcpListener;

use crate::catalog::{Catalog, CatalogError};
use crate::domain::{ContentHash, UnixMillis};
use crate::raster;
use crate::store::Project;

pub use control::Rates;
pub use deck::DeckOptions;
pub use keys::{KeyError, key_map};
pub use words::Language;

use card::Card;
use desk::Desk;
use guard::START;
use pictures::Pictures;
use session::Session;

/// How the page is served.
#[derive(Debug, Clone)]
pub struct ReviewOptions {
    /// Who reads what.
    pub deck: DeckOptions,
    /// Language of the page.
    pub language: Language,
    /// Keys by place to actions; from [`key_map`].
    pub keys: BTreeMap<String, String>,
    /// How long a picture is shown at least before a verdict is taken, milliseconds.
    pub min_view_ms: u64,
    /// Where to listen; port 0 takes that of the project and the reviewer, and any where that is taken.
    pub listen: SocketAddr,
    /// Limits on the print images.
    pub limits: raster::ImageLimits,
    /// The clock.
    pub now: fn() -> UnixMillis,
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum ReviewError {
    /// The address is taken or not ours.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
    /// The system has no randomness for the token.
    #[error("cannot make a token: {0}")]
    Token(std::io::Error),
    /// The deck cannot be read.
    #[error("cannot read what there is to judge: {0}")]
    Deck(String),
    /// The catalog refused.
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    /// The server broke down.
    #[error("the page stopped: {0}")]
    Serve(std::io::Error),
}

/// A page that is ready to be served.
#[derive(Debug)]
pub struct Review {
    listener: TcpListener,
    desk: Arc<Desk>,
    address: SocketAddr,
    cards: Cards,
}

/// How much there is to judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cards {
    /// Pictures in the deck.
    pub all: usize,
    /// Of these, those of results; the others test the reviewer.
    pub results: usize,
    /// Those that the reviewer has answered.
    pub answered: usize,
}

/// Binds and reads the deck.
///
/// # Errors
/// When the address cannot be had, or the catalog cannot be read.
pub async fn open(
    catalog: Catalog,
    project: Project,
    options: ReviewOptions,
) -> Result<Review, ReviewError> {
    let refused = |source| ReviewError::Listen {
        address: options.listen,
        source,
    };
    let usual = usual_port(&project, &options.deck.reviewer);
    let listener = listen(options.listen, usual).await.map_err(refused)?;
    let address = listener.local_addr().map_err(refused)?;
    let desk = Desk {
        pictures: Pictures::new(catalog.clone(), project.clone(), options.limits),
        session: Session::new(address.port()).map_err(ReviewError::Token)?,
        hosts: hosts(address),
        catalog,
        project,
        deck_options: options.deck,
        language: options.language,
        keys: options.keys,
        min_view_ms: options.min_view_ms,
        now: options.now,
        dealt: std::sync::Mutex::default(),
    };
    // An answer that was not acknowledged before a restart may come before anybody asks for the deck.
    let deck = desk.deal().await;
    let deck = deck.map_err(|error| ReviewError::Deck(error.to_string()))?;
    let count = |is: &dyn Fn(&Card) -> bool| deck.cards.iter().filter(|card| is(card)).count();
    Ok(Review {
        cards: Cards {
            all: deck.cards.len(),
            results: count(&|card| card.control.is_none()),
            answered: count(&|card| deck.known.answer(card).is_some()),
        },
        listener,
        desk: Arc::new(desk),
        address,
    })
}

impl Review {
    /// The address to open, good for one time.
    pub fn url(&self) -> String {
        format!(
            "http://{}{START}?token={}",
            self.address,
            self.desk.session.token()
        )
    }

    /// The address without the token.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// How much there is to judge.
    pub const fn cards(&self) -> Cards {
        self.cards
    }

    /// Answers until `stop` is done.
    ///
    /// # Errors
    /// When the socket breaks down.
    pub async fn serve(
        self,
        stop: impl Future<Output = ()> + Send + 'static,
    ) -> Result<(), ReviewError> {
        let router = routes::router(&self.desk);
        axum::serve(self.listener, router)
            .with_graceful_shutdown(stop)
            .await
            .map_err(ReviewError::Serve)
    }
}

/// The first of the ports that are nobody's, and how many there are (RFC 6335).
const FREE_PORTS: [u16; 2] = [49_152, 16_384];

/// The same for a project and a reviewer every time: what a browser keeps for a page that is gone, it keeps for its port.
fn usual_port(project: &Project, reviewer: &str) -> u16 {
    let dir = project.dir();
    let dir = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    let whose = format!("{}\0{reviewer}", dir.display());
    let [first, second, ..] = *ContentHash::of(whose.as_bytes()).as_bytes();
    FREE_PORTS[0] + u16::from_be_bytes([first, second]) % FREE_PORTS[1]
}

/// Binds; where any port will do, the usual one if it is free.
async fn listen(address: SocketAddr, usual: u16) -> std::io::Result<TcpListener> {
    if address.port() == 0
        && let Ok(listener) = TcpListener::bind(SocketAddr::new(address.ip(), usual)).await
    {
        return Ok(listener);
    }
    TcpListener::bind(address).await
}

/// Names by which the page may be asked for.
fn hosts(address: SocketAddr) -> Vec<String> {
    let port = address.port();
    let mut hosts = vec![address.to_string()];
    if address.ip().is_loopback() {
        hosts.extend([format!("localhost:{port}"), format!("127.0.0.1:{port}")]);
    }
    hosts
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use super::listen;

    #[tokio::test]
    async fn the_usual_port_is_taken_where_it_is_free_and_any_port_will_do() {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let port =
            |listener: &tokio::net::TcpListener| listener.local_addr().expect("an address").port();
        let probe = listen(any, 0).await.expect("a socket");
        let usual = port(&probe);
        let other = listen(any, usual).await.expect("a socket");
        assert_ne!(port(&other), usual, "it is taken");
        drop(probe);
        let again = listen(any, usual).await.expect("a socket");
        assert_eq!(port(&again), usual);
    }
}

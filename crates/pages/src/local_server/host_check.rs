//! Checks the `Host` of requests to a server without a session, against DNS rebinding.
//!
//! A web page can make the browser of a visitor ask any address of the visitor's network: its name first leads to its own
//! server, and then to that address. `Host` then still has the name of the page, so a server that knows its own names
//! refuses the request. An IP address leads nowhere else, and only a network's administrator gives out names without a
//! dot.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};
use axum::{Router, middleware};

/// The host names that a server without a session accepts: IP addresses, `localhost`, and names that the user gives. A
/// server that other computers can reach also accepts the name of its computer, and names without a dot.
#[derive(Debug)]
pub struct ServedNames {
    /// In lower case.
    names: Vec<String>,
    has_short_names: bool,
}

impl ServedNames {
    /// Returns the names of a server that is bound to `address` on the computer `computer`.
    pub fn new(address: SocketAddr, computer: &str, of_user: &[String]) -> Self {
        let is_local = address.ip().is_loopback();
        let own = (!is_local).then_some(computer);
        let names = own.into_iter().chain(of_user.iter().map(String::as_str));
        Self {
            names: names.map(str::to_ascii_lowercase).collect(),
            has_short_names: !is_local,
        }
    }

    /// Returns `pages`, which refuses requests with another name in `Host`. The port may be another one, because
    /// containers and tunnels have their own.
    pub fn guarded(self, pages: Router) -> Router {
        pages.layer(middleware::from_fn_with_state(Arc::new(self), check))
    }

    fn has(&self, host: &str) -> bool {
        let Ok(host) = host.parse::<Authority>() else {
            return false;
        };
        let name = host.host().to_ascii_lowercase();
        let address = name.trim_start_matches('[').trim_end_matches(']');
        address.parse::<IpAddr>().is_ok()
            || name == "localhost"
            || (self.has_short_names && !name.is_empty() && !name.contains('.'))
            || self.names.contains(&name)
    }
}

async fn check(State(served): State<Arc<ServedNames>>, request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST);
    if host.is_some_and(|host| host.to_str().is_ok_and(|host| served.has(host))) {
        return next.run(request).await;
    }
    let text = "this host name is not served: ask for the IP address, or name the host with --metrics-host\n";
    (StatusCode::MISDIRECTED_REQUEST, text).into_response()
}

#[cfg(test)]
mod tests {
    use super::ServedNames;

    fn served(address: &str, of_user: &[&str]) -> ServedNames {
        let of_user: Vec<String> = of_user.iter().map(|name| (*name).to_owned()).collect();
        let address = address.parse().expect("an address");
        ServedNames::new(address, "Node1.lab.example", &of_user)
    }

    #[test]
    fn only_addresses_and_localhost_are_names_of_a_local_server() {
        let served = served("127.0.0.1:9464", &[]);
        for host in [
            "127.0.0.1:9464",
            "127.0.0.1:1",
            "127.0.0.1",
            "[::1]:9464",
            "10.0.0.7:9464",
            "LOCALHOST:9464",
            "localhost",
        ] {
            assert!(served.has(host), "{host}");
        }
        for host in [
            "",
            ":9464",
            "evil.example",
            "evil.example:9464",
            "127.0.0.1.evil.example:9464",
            "localhost.evil.example",
            "10.0.0.7.",
            "node1.lab.example",
            "worker:9464",
            "a b",
        ] {
            assert!(!served.has(host), "{host}");
        }
    }

    #[test]
    fn a_server_in_a_network_has_short_names_that_of_its_computer_and_those_of_the_user() {
        let served = served("0.0.0.0:9464", &["Metrics.cluster.example"]);
        for host in [
            "worker:9464",
            "node1.lab.example:9464",
            "metrics.cluster.example:80",
            "[fe80::1]:9464",
        ] {
            assert!(served.has(host), "{host}");
        }
        for host in [
            "node2.lab.example:9464",
            "cluster.example",
            "evil.example:9464",
        ] {
            assert!(!served.has(host), "{host}");
        }
    }
}

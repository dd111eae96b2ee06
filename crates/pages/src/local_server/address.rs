//! Binds the port of a server.

use std::net::{IpAddr, SocketAddr, UdpSocket};

use tokio::net::TcpListener;

use mocban_core::domain::ContentHash;

/// First port and number of ports of the dynamic range (RFC 6335).
const DYNAMIC_PORTS: [u16; 2] = [49_152, 16_384];

/// Binds the address. Port 0 tries a port that depends only on `name`, so that a restarted server has the same origin,
/// and then any free port.
pub async fn listen(address: SocketAddr, name: &str) -> std::io::Result<TcpListener> {
    if address.port() == 0
        && let Ok(listener) =
            TcpListener::bind(SocketAddr::new(address.ip(), preferred_port(name))).await
    {
        return Ok(listener);
    }
    TcpListener::bind(address).await
}

/// Returns the address of this computer in its network; `None` without a network. Nothing is sent: connecting a datagram
/// socket only chooses a route. The targets are reserved for documentation (RFC 5737 and 3849).
pub fn network_address() -> Option<IpAddr> {
    let routes = [("0.0.0.0:0", "192.0.2.1:9"), ("[::]:0", "[2001:db8::1]:9")];
    routes.into_iter().find_map(|(from, to)| {
        let socket = UdpSocket::bind(from).ok()?;
        socket.connect(to).ok()?;
        Some(socket.local_addr().ok()?.ip())
    })
}

/// Returns a port of the dynamic range that is the same for equal names.
fn preferred_port(name: &str) -> u16 {
    let [first, second, ..] = *ContentHash::of(name.as_bytes()).as_bytes();
    DYNAMIC_PORTS[0] + u16::from_be_bytes([first, second]) % DYNAMIC_PORTS[1]
}

/// Returns the accepted values of the `Host` header.
pub(super) fn hosts(address: SocketAddr) -> Vec<String> {
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

    use super::{listen, preferred_port};

    #[tokio::test]
    async fn port_zero_prefers_the_fixed_port_if_it_is_free() {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        // Any connection of another process may have a port of the dynamic range at any moment.
        for number in 0..100 {
            let name = format!("test {number} of ports");
            let port = async || {
                let listener = listen(any, &name).await.expect("a socket");
                (listener.local_addr().expect("an address").port(), listener)
            };
            let preferred = preferred_port(&name);
            let (first, probe) = port().await;
            let (second, _other) = port().await;
            assert!(first != preferred || second != preferred, "it is taken");
            drop(probe);
            let (rebound, _again) = port().await;
            if first == preferred && rebound == preferred {
                return;
            }
        }
        unreachable!("no server gets its port");
    }
}

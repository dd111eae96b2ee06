//! Ports of servers that must listen on a known port, or on the same port again.

use std::net::TcpListener;
use std::ops::Range;
use std::sync::atomic::{AtomicU16, Ordering};

/// Systems give none of these ports to connections or to listeners that name no port: Linux begins at 32768, macOS at
/// 49152. Nothing else takes such a port while its server is not there.
const PORTS: Range<u16> = 20_000..32_000;

/// Returns a port that no other test of this process has, and on which nothing listens.
pub(crate) fn own_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let count = PORTS.end - PORTS.start;
    // Processes with tests that run at the same time begin at different ports.
    let first = (std::process::id().wrapping_mul(101) % u32::from(count)) as u16;
    for _ in 0..count {
        let step = NEXT.fetch_add(1, Ordering::Relaxed) % count;
        let port = PORTS.start + (first + step) % count;
        if TcpListener::bind(("127.0.0.1", port)).is_ok() {
            return port;
        }
    }
    unreachable!("every port is in use")
}

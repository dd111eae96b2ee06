//! `--metrics`: serves the counts and times of a run to Prometheus.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Bytes;
use axum::http::header;
use axum::routing::get;
use clap::Args;
use tokio::net::TcpListener;
use tokio::task::AbortHandle;

use crate::cli::output::context::Context;
use mocban_core::locked;
use mocban_pages::local_server::{ConnectionLimits, ServedNames, listen, serve};
use mocban_project::Refusal;
use mocban_runner::RunMetrics;
use mocban_system::failpoint::time_scale;
use mocban_system::platform::host_name;

/// Version 0.0.4 of the text format, which every version of Prometheus reads.
const TEXT_FORMAT: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Maximum age of the metrics in a response. Prometheus asks every 15 s or less often.
const RENDER_INTERVAL: Duration = Duration::from_secs(1);

/// Parses `PORT` or `ADDRESS:PORT`. A port alone is on 127.0.0.1.
fn address(text: &str) -> Result<SocketAddr, String> {
    if let Ok(port) = text.parse() {
        return Ok((Ipv4Addr::LOCALHOST, port).into());
    }
    let example = "give a port of this machine, such as 9464, or an address with a port, such as 10.0.0.7:9464";
    text.parse().ok().ok_or_else(|| example.to_owned())
}

/// Arguments of the server of the metrics.
#[derive(Debug, Default, Args)]
pub(crate) struct MetricsArgs {
    /// Serve counts and times of this process to Prometheus at a port of this machine, such as 9464, or at an address
    /// that others can reach, such as 10.0.0.7:9464
    #[arg(long, value_name = "PORT", value_parser = address)]
    metrics: Option<SocketAddr>,
    /// Answer requests for the metrics under this host name too, such as node1.lab.example; may be repeated. IP addresses,
    /// localhost and, from other machines, names without a dot are always answered
    #[arg(long, value_name = "NAME", requires = "metrics")]
    metrics_host: Vec<String>,
}

/// The server of the metrics, with its port bound.
#[derive(Debug)]
pub(crate) struct MetricsServer {
    listener: TcpListener,
    address: SocketAddr,
    names: ServedNames,
}

/// A server that ends when this handle is dropped.
#[derive(Debug)]
pub(crate) struct Serving(AbortHandle);

impl Drop for Serving {
    fn drop(&mut self) {
        self.0.abort();
    }
}

impl MetricsServer {
    /// Binds the address, if one is given.
    ///
    /// # Errors
    /// Returns an error if the address cannot be bound, for example because another process uses the port.
    pub(crate) async fn bind(args: &MetricsArgs) -> Result<Option<Self>, Refusal> {
        let Some(address) = args.metrics else {
            return Ok(None);
        };
        let failed = |error| {
            Refusal::Usage(format!(
                "cannot serve metrics on {address}: {error}; choose another port with --metrics"
            ))
        };
        let listener = listen(address, "metrics").await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let names = ServedNames::new(address, &host_name(), &args.metrics_host);
        Ok(Some(Self {
            listener,
            address,
            names,
        }))
    }

    /// Serves the metrics until the handle is dropped. Prints the address.
    pub(crate) fn serve(self, metrics: RunMetrics, context: &Context) -> Serving {
        let address = self.address;
        context.info(&format!("metrics: http://{address}/metrics"));
        if !address.ip().is_loopback() {
            context.warn(&format!(
                "the metrics are served on {address}, which other machines can reach, and the traffic is not encrypted"
            ));
        }
        let text = Arc::new(RenderedMetrics::default());
        let render = move || text.at(Instant::now(), || metrics.prometheus_text());
        let kind = [(header::CONTENT_TYPE, TEXT_FORMAT)];
        let router = Router::new().route("/metrics", get(async move || (kind, render())));
        let router = self.names.guarded(router);
        let limits = ConnectionLimits::of_rare_requests();
        let serving = serve(self.listener, router, limits, std::future::pending());
        Serving(tokio::spawn(serving).abort_handle())
    }
}

/// The text of the metrics, rendered once in [`RENDER_INTERVAL`] however many requests arrive.
#[derive(Debug, Default)]
struct RenderedMetrics(Mutex<Option<(Instant, Bytes)>>);

impl RenderedMetrics {
    fn at(&self, now: Instant, render: impl FnOnce() -> String) -> Bytes {
        let interval = RENDER_INTERVAL / time_scale("MOCBAN_TIME_SCALE");
        let mut rendered = locked(&self.0);
        match &*rendered {
            Some((at, text)) if now.duration_since(*at) < interval => text.clone(),
            _ => {
                let text = Bytes::from(render());
                *rendered = Some((now, text.clone()));
                text
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{RENDER_INTERVAL, RenderedMetrics, address};

    #[test]
    fn metrics_are_rendered_once_a_second() {
        let (text, start) = (RenderedMetrics::default(), Instant::now());
        let at = |after: Duration, value: &str| text.at(start + after, || value.to_owned());
        assert_eq!(at(Duration::ZERO, "1"), "1");
        assert_eq!(at(RENDER_INTERVAL / 2, "2"), "1");
        assert_eq!(at(RENDER_INTERVAL, "3"), "3");
    }

    #[test]
    fn a_port_alone_is_on_this_machine() {
        let parsed = |text| address(text).map(|address| address.to_string());
        assert_eq!(parsed("9464").as_deref(), Ok("127.0.0.1:9464"));
        assert_eq!(parsed("127.0.0.1:9464").as_deref(), Ok("127.0.0.1:9464"));
        assert_eq!(parsed("[::1]:9464").as_deref(), Ok("[::1]:9464"));
        assert_eq!(parsed("0.0.0.0:9464").as_deref(), Ok("0.0.0.0:9464"));
        for wrong in ["", "70000", "node1", "node1:9464", "127.0.0.1"] {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }
}

//! `--metrics`: serves the counts and times of a run to Prometheus.

use std::net::{Ipv4Addr, SocketAddr};

use axum::Router;
use axum::http::header;
use axum::response::IntoResponse;
use axum::routing::get;
use clap::Args;
use tokio::net::TcpListener;
use tokio::task::AbortHandle;

use crate::cli::output::context::Context;
use mocban_pages::local_server::{ConnectionLimits, ServedNames, listen, serve};
use mocban_project::exit::Refusal;
use mocban_runner::RunMetrics;
use mocban_system::platform::host_name;

/// Version 0.0.4 of the text format, which every version of Prometheus reads.
const TEXT_FORMAT: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Parses `PORT` or `ADDRESS:PORT`. A port alone is on 127.0.0.1.
fn address(text: &str) -> Result<SocketAddr, String> {
    if let Ok(port) = text.parse() {
        return Ok((Ipv4Addr::LOCALHOST, port).into());
    }
    let example = "metrics are served at a port of this machine, such as 9464, or at an address with a port, such as 10.0.0.7:9464";
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
        let router = Router::new().route("/metrics", get(async move || text(&metrics)));
        let router = self.names.guarded(router);
        let limits = ConnectionLimits::system();
        let serving = serve(self.listener, router, limits, std::future::pending());
        Serving(tokio::spawn(serving).abort_handle())
    }
}

fn text(metrics: &RunMetrics) -> impl IntoResponse + use<> {
    (
        [(header::CONTENT_TYPE, TEXT_FORMAT)],
        metrics.prometheus_text(),
    )
}

#[cfg(test)]
mod tests {
    use super::address;

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

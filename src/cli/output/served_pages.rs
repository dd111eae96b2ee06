//! Serves pages to the browser of this machine until the user ends it.

use std::net::{Ipv4Addr, SocketAddr};

use axum::Router;

use super::context::Context;
use super::page_address::{open_page, print_address};
use crate::cli::input::signals;
use mocban_pages::local_server::LocalServer;
use mocban_project::{ExitCode, ProjectResult};
use mocban_runner::{Stop, StopLevel};

/// Pages, and how they are served.
#[derive(Debug)]
pub(crate) struct ServedPages<'a> {
    pub(crate) pages: Router,
    /// Port 0 chooses the same port for equal names.
    pub(crate) name: &'a str,
    pub(crate) port: u16,
    /// Name of the command, after which the cookies are named.
    pub(crate) command: &'a str,
    /// What follows when the user ends it.
    pub(crate) ending: &'a str,
    pub(crate) no_open: bool,
}

impl ServedPages<'_> {
    /// Announces the address and serves the pages. The first Ctrl-C lets open requests end.
    pub(crate) async fn serve(self, context: &Context) -> ProjectResult<ExitCode> {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, self.port));
        let server = LocalServer::bind(address, self.name, self.command).await?;
        let stop = Stop::default();
        let signals = signals::watch(&stop)?;
        let url = server.url();
        print_address(&url, context)?;
        let ending = self.ending;
        context.info(&format!(
            "the address works once, in one browser; press Ctrl-C to end{ending}"
        ));
        let _file = open_page(&url, self.no_open, context);
        let drain = stop.clone();
        let ended = async move { drain.reached(StopLevel::Drain).await };
        tokio::select! {
            _ = server.serve(self.pages, ended) => {}
            () = stop.reached(StopLevel::Now) => {}
        }
        signals.abort();
        Ok(ExitCode::Done)
    }
}

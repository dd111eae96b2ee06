//! Opens a page in the system's browser.

use std::io::Write as _;
use std::process::{Command, Stdio};

/// Opens the address in the system's browser, through a private file that redirects to it. Returns the file, which must
/// exist until the browser has read it. The token in the address
/// therefore does not appear in the list of processes. A missing browser is not an error, because the address is
/// printed.
pub(crate) fn open(url: &str) -> Option<tempfile::NamedTempFile> {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(windows) {
        "explorer"
    } else {
        let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"].map(std::env::var_os);
        has_screen.iter().flatten().next()?;
        "xdg-open"
    };
    let mut file = tempfile::Builder::new().suffix(".html").tempfile().ok()?;
    let page = format!("<meta http-equiv=\"refresh\" content=\"0;url={url}\">");
    file.write_all(page.as_bytes()).ok()?;
    let started = Command::new(program)
        .arg(file.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    if let Err(error) = started {
        tracing::debug!(%error, "no browser was opened");
    }
    Some(file)
}

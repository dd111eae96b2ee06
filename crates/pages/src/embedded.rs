//! Scripts and styles that are embedded in the program. The pages load nothing from other hosts.

use axum::http::{StatusCode, header};
use axum::response::{IntoResponse as _, Response};

use mocban_export::scan_view;

/// Content type of a script.
pub(crate) const SCRIPT: &str = "text/javascript; charset=utf-8";
/// Content type of a style.
pub(crate) const STYLE: &str = "text/css; charset=utf-8";

/// Name, content type and text of a script or style.
pub(crate) type EmbeddedAsset = (&'static str, &'static str, &'static str);

/// Builds an asset from its folder in `assets`, its name and its content type.
macro_rules! embedded_asset {
    ($folder:literal, $name:literal, $kind:ident) => {
        (
            $name,
            $kind,
            include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/../../assets/",
                $folder,
                "/",
                $name
            )),
        )
    };
}
pub(crate) use embedded_asset;

/// The script of all pages that reads replies of the server.
const REPLY: EmbeddedAsset = embedded_asset!("local-server", "reply.js", SCRIPT);

/// Returns content type and text of an asset of a page, of all pages or of the 3D view.
pub(crate) fn find(own: &[EmbeddedAsset], name: &str) -> Option<(&'static str, &'static str)> {
    let mut known = own.iter().chain([&REPLY]);
    let found = known.find(|(asset, ..)| *asset == name);
    let found = found.map(|(_, kind, text)| (*kind, *text));
    found.or_else(|| scan_view::assets::find(name))
}

/// Responds with an asset of a page, of all pages or of the 3D view.
pub(crate) fn asset(own: &[EmbeddedAsset], name: &str) -> Response {
    match find(own, name) {
        Some((kind, text)) => ([(header::CONTENT_TYPE, kind)], text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::REPLY;
    use crate::local_server::assert_loads_nothing;

    #[test]
    fn the_script_of_all_pages_refers_to_no_other_host() {
        let (name, _, text) = REPLY;
        assert_loads_nothing(name, text);
    }
}

//! A QR code as a picture in a page.

use maud::{Markup, html};
use qrcode::types::{Color, QrError};
use qrcode::{EcLevel, QrCode};

/// Light border that readers need, in modules (ISO/IEC 18004).
const QUIET_ZONE: usize = 4;

/// Returns the QR code of a text as SVG.
///
/// # Errors
/// Returns an error if the text has more than 2,953 bytes.
pub(super) fn qr_code(text: &str, label: &str) -> Result<Markup, QrError> {
    let code = QrCode::with_error_correction_level(text, EcLevel::L)?;
    let width = code.width();
    let mut path = String::new();
    for (index, color) in code.to_colors().into_iter().enumerate() {
        if color == Color::Dark {
            let [x, y] = [index % width, index / width].map(|at| at + QUIET_ZONE);
            path.extend([format!("M{x} {y}h1v1h-1z")]);
        }
    }
    let side = width + 2 * QUIET_ZONE;
    Ok(html! {
        svg.qr viewBox={ "0 0 " (side) " " (side) } role="img" aria-label=(label) { rect width="100%" height="100%" {} path d=(path) {} }
    })
}

#[cfg(test)]
mod tests {
    use super::qr_code;

    #[test]
    fn a_link_has_a_code_with_three_finder_patterns_and_a_border() {
        let svg = qr_code("http://192.168.1.20:50000/start?token=0", "QR").expect("a code");
        let svg = svg.into_string();
        // Version 3 has 29 modules; the finder patterns are 7 modules wide and begin at the corners.
        assert!(svg.contains("viewBox=\"0 0 37 37\""), "{svg}");
        for corner in ["M4 4", "M26 4", "M4 26"] {
            assert!(svg.contains(&format!("{corner}h1v1h-1z")), "{corner}");
        }
        assert!(!svg.contains("M0 0h") && !svg.contains("M11 4h"), "{svg}");
        assert!(qr_code(&"x".repeat(3000), "QR").is_err());
    }
}

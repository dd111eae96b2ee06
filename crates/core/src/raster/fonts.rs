//! The fonts that are compiled in.

/// A subset of `HanaMin` A and B: 970 characters frequent in Nôm texts. See `assets/LICENSE-mocban-demo-mincho.txt`.
pub static MINCHO: &[u8] = include_bytes!("../../../../assets/mocban-demo-mincho.ttf");

/// A subset of Noto Sans: Latin letters with Vietnamese, digits and signs. See `assets/LICENSE-mocban-label-sans.txt`.
pub static LABEL_SANS: &[u8] = include_bytes!("../../../../assets/mocban-label-sans.ttf");

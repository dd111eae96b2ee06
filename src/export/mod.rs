//! Aligned pairs for other tools.

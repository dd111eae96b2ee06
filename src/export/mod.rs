//! Aligned pairs and pictures for other tools and for people.

pub mod pictures;

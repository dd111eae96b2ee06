//! The durable queue through the library.

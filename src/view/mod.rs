//! The page of `mocban view`: a local web server that shows one scan on its print in 3D.

mod page;
mod server;

pub use server::{ViewError, ViewServer, bind};

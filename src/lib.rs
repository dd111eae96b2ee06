//! `mocban` aligns 3D scans of carved woodblock characters with images of their prints.

pub mod catalog;
pub mod cli;
pub mod config;
pub mod demo;
pub mod domain;
pub mod export;
pub mod manifest;
pub mod mesh;
pub mod raster;
pub mod report;
pub mod runner;
pub mod stages;
pub mod store;

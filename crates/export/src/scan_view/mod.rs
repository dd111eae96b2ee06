//! The interactive 3D view of a scan on its print: its data, its scripts, and a page that opens without a server.

pub mod assets;
mod lone_scan;
mod scan_data;
mod standalone_page;
mod view_inputs;

pub use lone_scan::scan_alone;
pub use scan_data::ScanView;
pub(super) use standalone_page::standalone_page;

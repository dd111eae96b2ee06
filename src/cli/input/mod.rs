//! What users name: flags, pairs, folders, signals.

pub(crate) mod browser;
pub(crate) mod examples;
pub(crate) mod global;
pub(crate) mod hyphen_tip;
pub(crate) mod language;
pub(crate) mod listen_address;
pub(crate) mod name_request;
pub(crate) mod nearby_projects;
pub(crate) mod signals;

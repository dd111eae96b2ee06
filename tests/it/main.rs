//! Integration tests in one binary.

mod backup;
mod check;
mod cli;
mod decoys;
mod demo;
#[cfg(target_os = "linux")]
mod fault;
#[cfg(target_os = "linux")]
mod faults;
mod hostile;
mod invariance;
mod kill;
mod layers;
mod limits;
mod odd;
mod one_pair;
#[cfg(target_os = "linux")]
mod power;
mod processes;
mod queue;
mod report;
mod resume;
mod semi_real;
#[cfg(target_os = "linux")]
mod shim;
mod unbroken;

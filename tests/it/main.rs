//! Integration tests in one binary.

mod backup;
mod check;
mod cli;
mod decoys;
mod demo;
mod hostile;
mod invariance;
mod kill;
mod layers;
mod limits;
mod odd;
mod one_pair;
mod processes;
mod queue;
mod report;
mod resume;
mod semi_real;

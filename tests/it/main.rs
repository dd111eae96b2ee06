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
mod odd;
mod one_pair;
mod queue;
mod report;
mod resume;
mod semi_real;

//! Bad inputs: one clear line each, no harm to others.

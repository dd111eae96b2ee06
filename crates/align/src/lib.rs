//! Plane, depth map, masks and registration: what the program computes.
//!
//! - [`stages`]: one character. `fit` finds the plane, `depth` renders the depth map, `normalize` finds ink and relief
//!   heights, `register` finds the pose and one threshold per metric. [`stages::AlignedPair`] runs all four.
//! - [`block`]: a whole carved face and the image of its page: height map, registration, characters, cut
//!
//! **Invariant:** each function returns the same bits for the same arguments, whatever the number of threads and the
//! processor. Nothing here opens a file, reads a clock or remembers a call.
//!
//! Loops over vertices, triangles or pixels poll the cancellation of their thread ([`mocban_core::domain::cancel`]).

pub mod block;
pub mod stages;

//! Plane, depth map, masks and registration: what the program computes.
//!
//! - [`stages`]: one character. `fit` finds the plane, `depth` renders the depth map, `normalize` finds ink and relief
//!   heights, `register` finds the pose and one threshold per metric. [`stages::AlignedPair`] runs all four.
//! - [`block`]: a whole carved face and the image of its page: height map, registration, characters, cut
//! - [`scan_size`]: scans of an unexpected size, such as whole blocks or wrong units
//!
//! **Invariant:** each function returns the same bits for the same arguments, whatever the number of threads. Nothing here
//! opens a file, reads a clock or remembers a call. On another kind of processor, Fourier transforms are rounded
//! differently.
//!
//! `fit` reads the print too, to decide which side of the mesh is carved: on 740 generated pairs, the relief alone decided
//! it for 13 %, and other evidence for at most 2 % more. For the others, `fit` and `depth` would process both sides, with
//! 25 % more CPU time. [`stages::pipeline`] shows both methods side by side. A pair that was cut from a block gets the pose
//! that the block expects ([`mocban_core::domain::AlignmentPrior`]), and a single stroke the normal of the block.
//!
//! Loops over vertices, triangles or pixels poll the cancellation of their thread ([`mocban_core::domain::cancel`]).

pub mod block;
pub mod scan_size;
pub mod stages;

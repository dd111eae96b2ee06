//! The built-in dataset: glyphs carved into meshes and printed, with known truth, from one seed.

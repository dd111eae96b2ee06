//! Reader of Wavefront OBJ files (<https://paulbourke.net/dataformats/obj/>).
//!
//! The module `plain` reads usual files in a single pass over their bytes. All other files are read by the crate `tobj`,
//! which takes 6 times as long on 500,000 vertices (module `by_tobj`). Both give the same mesh.
//!
//! Normals, texture coordinates, colours, groups and materials are not used, so faults in them do not matter.

mod by_tobj;
#[cfg(test)]
mod odd_tests;
mod plain;
#[cfg(test)]
mod tests;

use super::error::{MeshError, MeshLimits};
use super::text;
use super::triangle_mesh::Mesh;

/// Reads an OBJ file.
///
/// A mesh with faces holds the vertices that its faces use, in the order of their first use. A file without faces is a
/// point set with all its vertices. Returns the mesh, and how many faces with fewer than three corners were left out.
///
/// # Errors
/// Returns an error if the file exceeds the limits, a line is too long, a `v` or `f` line cannot be parsed, or a face
/// refers to a missing vertex.
pub(super) fn read(bytes: &[u8], limits: &MeshLimits) -> Result<(Mesh, u64), MeshError> {
    text::check_lines(bytes)?;
    check_end(bytes)?;
    match plain::read(bytes, limits) {
        Ok(mesh) => mesh,
        Err(odd) => by_tobj::read(bytes, odd, limits),
    }
}

/// Refuses a file that ends within a face of fewer than three corners. Elsewhere, such faces are left out.
fn check_end(bytes: &[u8]) -> Result<(), MeshError> {
    let Some(last) = text::unended_line(bytes) else {
        return Ok(());
    };
    let mut words = text::words(last);
    let is_face = words.next() == Some(b"f");
    let corners = words.take_while(|word| !word.starts_with(b"#")).count();
    if !is_face || corners >= 3 {
        return Ok(());
    }
    let line = text::lines(bytes).count() as u64;
    let noun = if corners == 1 { "corner" } else { "corners" };
    let cut_off = text::CUT_OFF;
    let reason = format!("the last line is a face with {corners} {noun}; {cut_off}");
    Err(MeshError::Line { line, reason })
}

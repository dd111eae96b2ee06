//! Reads arbitrary bytes as a mesh file: gives a one-line error, or a mesh with the documented properties.

#![no_main]

use libfuzzer_sys::fuzz_target;
use mocban::mesh::{MeshLimits, Vertices, read};

/// Limits that small files can exceed.
const LIMITS: MeshLimits = MeshLimits {
    max_bytes: 1 << 20,
    max_vertices: 5000,
    max_triangles: 5000,
};

fuzz_target!(|bytes: &[u8]| {
    for name in ["scan", "scan.stl"] {
        match read(bytes, name, &LIMITS) {
            Ok(mesh) => {
                let capacity = match &mesh.vertices {
                    Vertices::Single(all) => all.capacity(),
                    Vertices::Double(all) => all.capacity(),
                };
                assert!(capacity <= 2 * bytes.len() + 64);
                assert!(mesh.vertices.len() as u64 <= LIMITS.max_vertices);
                assert!(mesh.triangles.len() as u64 <= LIMITS.max_triangles);
                assert!(mesh.vertices.iter().flatten().all(f64::is_finite));
                let count = mesh.vertices.len() as u32;
                assert!(mesh.triangles.as_flattened().iter().all(|i| *i < count));
            }
            Err(error) => mocban_fuzz::one_sentence(&error.to_string()),
        }
    }
});

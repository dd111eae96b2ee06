//! Runs all four stages on arbitrary bytes as a mesh. The first byte selects the print.

#![no_main]

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use mocban::config::{Config, Sources, load};
use mocban::mesh;
use mocban::raster::{PrintImage, decode};
use mocban::stages::{AlignedPair, Print, StageError};

const LIMITS: mesh::MeshLimits = mesh::MeshLimits {
    max_bytes: 1 << 20,
    max_vertices: 5000,
    max_triangles: 5000,
};

fn config() -> &'static Config {
    static CONFIG: OnceLock<Config> = OnceLock::new();
    CONFIG.get_or_init(|| load(&Sources::default()).expect("the defaults").config)
}

fn prints() -> &'static [PrintImage] {
    static PRINTS: OnceLock<Vec<PrintImage>> = OnceLock::new();
    PRINTS.get_or_init(|| {
        let limits = config().limits.image;
        let images = mocban_fuzz::images();
        images
            .iter()
            .filter_map(|bytes| decode(bytes, &limits).ok())
            .collect()
    })
}

fn align(bytes: &[u8], print: &PrintImage) -> Result<(), StageError> {
    let settings = &config().stages;
    let Ok(mesh) = mesh::read(bytes, "scan.stl", &LIMITS) else {
        return Ok(());
    };
    AlignedPair::new(&mesh.into(), &Print::from(print.clone()), settings)?;
    Ok(())
}

fuzz_target!(|bytes: &[u8]| {
    let [choice, bytes @ ..] = bytes else { return };
    let prints = prints();
    if let Err(error) = align(bytes, &prints[usize::from(*choice) % prints.len()]) {
        mocban_fuzz::one_sentence(&error.to_string());
    }
});

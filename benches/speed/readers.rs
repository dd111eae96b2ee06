//! Reading meshes, beside reading their bytes, and the OBJ also by `tobj`.

use std::fs::File;
use std::path::Path;

use criterion::{Criterion, Throughput};
use mocban::mesh::{self, Mesh};

use super::files::{Files, MESHES, bytes};

pub(super) fn measure(criterion: &mut Criterion, files: &Files) -> anyhow::Result<()> {
    for (ending, _) in MESHES {
        let path = files.mesh(ending);
        let held = bytes(&path)?;
        let name = format!("scan.{ending}");
        let mut group = criterion.benchmark_group(format!("read/{ending}"));
        group.throughput(Throughput::Bytes(held.len() as u64));
        group.bench_function(files.size, |b| {
            b.iter(|| mesh::read(&held, &name, &mesh::MeshLimits::SUGGESTED));
        });
        group.finish();
        if ending == "obj" {
            criterion
                .benchmark_group("read/tobj_obj")
                .bench_function(files.size, |b| b.iter(|| by_tobj(&held)));
        }
        criterion
            .benchmark_group(format!("read/file_{ending}"))
            .bench_function(files.size, |b| b.iter(|| from_file(&path, &name)));
        let mut raw = criterion.benchmark_group(format!("read/raw_{ending}"));
        raw.throughput(Throughput::Bytes(held.len() as u64));
        raw.bench_function(files.size, |b| b.iter(|| bytes(&path)));
        raw.finish();
    }
    Ok(())
}

/// From the file itself, as a run reads it.
fn from_file(path: &Path, name: &str) -> anyhow::Result<Mesh> {
    let mut file = File::open(path)?;
    let about = file.metadata()?.len();
    Ok(mesh::read_from(
        &mut file,
        about,
        name,
        &mesh::MeshLimits::SUGGESTED,
    )?)
}

fn by_tobj(mut bytes: &[u8]) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    tobj::load_obj_buf(&mut bytes, &options, no_materials).map(|(models, _)| models)
}

//! Times reading meshes, reading their raw bytes, and reading the OBJ file with `tobj`.

use std::fs::File;
use std::path::Path;

use criterion::{Criterion, Throughput};
use mocban::mesh::{self, Mesh};

use super::files::{Files, MESHES, bytes};

pub(super) fn measure(criterion: &mut Criterion, files: &Files) -> anyhow::Result<()> {
    for (extension, _) in MESHES {
        let path = files.mesh(extension);
        let content = bytes(&path)?;
        let name = format!("scan.{extension}");
        let mut group = criterion.benchmark_group(format!("read/{extension}"));
        group.throughput(Throughput::Bytes(content.len() as u64));
        group.bench_function(files.size, |b| {
            b.iter(|| mesh::read(&content, &name, &mesh::MeshLimits::SUGGESTED));
        });
        group.finish();
        if extension == "obj" {
            criterion
                .benchmark_group("read/tobj_obj")
                .bench_function(files.size, |b| b.iter(|| by_tobj(&content)));
        }
        criterion
            .benchmark_group(format!("read/file_{extension}"))
            .bench_function(files.size, |b| b.iter(|| from_file(&path, &name)));
        let mut raw = criterion.benchmark_group(format!("read/raw_{extension}"));
        raw.throughput(Throughput::Bytes(content.len() as u64));
        raw.bench_function(files.size, |b| b.iter(|| bytes(&path)));
        raw.finish();
    }
    Ok(())
}

/// Reads from the file itself, as a run does.
fn from_file(path: &Path, name: &str) -> anyhow::Result<Mesh> {
    let mut file = File::open(path)?;
    let about = file.metadata()?.len();
    let read = mesh::read_from(&mut file, about, name, &mesh::MeshLimits::SUGGESTED)?;
    Ok(read.mesh)
}

fn by_tobj(mut bytes: &[u8]) -> Result<Vec<tobj::Model>, tobj::LoadError> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    tobj::load_obj_buf(&mut bytes, &options, no_materials).map(|(models, _)| models)
}

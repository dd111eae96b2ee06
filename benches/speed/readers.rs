//! Reading meshes, beside reading their bytes.

use criterion::{Criterion, Throughput};
use mocban::mesh;

use super::files::{Files, MESHES, bytes};

pub(super) fn measure(criterion: &mut Criterion, files: &Files) -> anyhow::Result<()> {
    for (ending, _) in MESHES {
        let path = files.mesh(ending);
        let held = bytes(&path)?;
        let name = format!("scan.{ending}");
        let mut group = criterion.benchmark_group(format!("read/{ending}"));
        group.throughput(Throughput::Bytes(held.len() as u64));
        group.bench_function(files.size, |b| {
            b.iter(|| mesh::read(&held, &name, &mesh::Limits::SUGGESTED));
        });
        group.finish();
        let mut raw = criterion.benchmark_group(format!("read/raw_{ending}"));
        raw.throughput(Throughput::Bytes(held.len() as u64));
        raw.bench_function(files.size, |b| b.iter(|| bytes(&path)));
        raw.finish();
    }
    Ok(())
}

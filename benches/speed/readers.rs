//! Reading meshes, beside reading their bytes.

use criterion::{Criterion, Throughput};
use mocban::mesh;

use super::scan::{MESHES, Scan, bytes};

pub(super) fn measure(criterion: &mut Criterion, scan: &Scan) -> anyhow::Result<()> {
    for (ending, _) in MESHES {
        let path = scan.mesh(ending);
        let held = bytes(&path)?;
        let name = format!("scan.{ending}");
        let mut group = criterion.benchmark_group(format!("read/{ending}"));
        group.throughput(Throughput::Bytes(held.len() as u64));
        group.bench_function(scan.size, |b| {
            b.iter(|| mesh::read(&held, &name, &mesh::Limits::SUGGESTED));
        });
        group.finish();
        let mut raw = criterion.benchmark_group(format!("read/raw_{ending}"));
        raw.throughput(Throughput::Bytes(held.len() as u64));
        raw.bench_function(scan.size, |b| b.iter(|| bytes(&path)));
        raw.finish();
    }
    Ok(())
}

//! Times each of the four stages, and a whole pair from the bytes of its files.

use criterion::{BatchSize, Criterion};
use mocban::config::{Sources, load};
use mocban::mesh::{self, Mesh};
use mocban::raster::{self, PrintImage};
use mocban::stages::{AlignedPair, Print, Scan, Settings, depth, fit, normalize, register};

use super::files::{Files, bytes};

pub(super) fn measure(criterion: &mut Criterion, files: &Files) -> anyhow::Result<()> {
    let settings = load(&Sources::default())?.config.stages;
    let (stl, png) = (bytes(&files.mesh("stl"))?, bytes(&files.print())?);
    let (mesh, picture) = (read(&stl)?, decode(&png)?);
    let print = Print::from(picture.clone());
    let aligned = AlignedPair::new(&mesh.clone().into(), &print, &settings)?;
    // Scans cache an indexed surface, and prints their binarizations. `fit` computes both, and `depth` only the
    // surface, so only these stages get fresh inputs.
    let fresh = |name: &str| match name {
        "fit" => (Scan::from(mesh.clone()), Print::from(picture.clone())),
        "depth" | "depth_1024" => (Scan::from(mesh.clone()), print.clone()),
        _ => (Scan::from(Mesh::default()), print.clone()),
    };
    let mut bench = |name: &str, run: &mut dyn FnMut(&Scan, &Print)| {
        let mut group = criterion.benchmark_group(format!("stages/{name}"));
        group.bench_function(files.size, |b| {
            let run = |(scan, print): (Scan, Print)| {
                run(&scan, &print);
                (scan, print)
            };
            b.iter_batched(|| fresh(name), run, BatchSize::PerIteration);
        });
        group.finish();
    };
    bench("fit", &mut |scan, print| {
        drop(fit::fit(scan, Some(print), None, &settings.fit));
    });
    bench("depth", &mut |scan, _| {
        drop(depth::depth(scan, &aligned.fit, None, &settings.depth));
    });
    let large = depth::DepthParams {
        longest_px: 1024,
        ..settings.depth.clone()
    };
    bench("depth_1024", &mut |scan, _| {
        drop(depth::depth(scan, &aligned.fit, None, &large));
    });
    bench("normalize", &mut |_, print| {
        drop(normalize::normalize(
            &aligned.depth,
            print,
            &settings.normalize,
        ));
    });
    bench("register", &mut |_, _| {
        drop(register::register(
            &aligned.depth,
            &aligned.normalized,
            None,
            &settings.register,
        ));
    });
    let mut whole = criterion.benchmark_group("pair");
    whole.bench_function(files.size, |b| b.iter(|| pair(&stl, &png, &settings)));
    whole.finish();
    Ok(())
}

/// Aligns a pair from the bytes of its files.
fn pair(stl: &[u8], png: &[u8], settings: &Settings) -> anyhow::Result<AlignedPair> {
    let print = Print::from(decode(png)?);
    Ok(AlignedPair::new(&read(stl)?.into(), &print, settings)?)
}

fn read(stl: &[u8]) -> anyhow::Result<Mesh> {
    Ok(mesh::read(stl, "scan.stl", &mesh::MeshLimits::SUGGESTED)?)
}

fn decode(png: &[u8]) -> anyhow::Result<PrintImage> {
    Ok(raster::decode(png, &raster::ImageLimits::SUGGESTED)?)
}

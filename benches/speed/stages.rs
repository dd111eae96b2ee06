//! The four stages one by one, and a whole pair from its files' bytes.

use criterion::{BatchSize, Criterion};
use mocban::config::{Sources, load};
use mocban::mesh::{self, Mesh};
use mocban::raster::{self, Picture};
use mocban::stages::{Aligned, Print, Settings, depth, fit, normalize, register};

use super::scan::{Scan, bytes};

pub(super) fn measure(criterion: &mut Criterion, scan: &Scan) -> anyhow::Result<()> {
    let settings = load(&Sources::default())?.config.stages;
    let (stl, png) = (bytes(&scan.mesh("stl"))?, bytes(&scan.print())?);
    let mesh = read(&stl)?;
    let picture = decode(&png)?;
    let print = Print::from(picture.clone());
    let aligned = Aligned::new(&mesh, &print, &settings)?;
    let mut bench = |name: &str, run: &mut dyn FnMut(&Print)| {
        let mut group = criterion.benchmark_group(format!("stages/{name}"));
        group.bench_function(scan.size, |b| {
            // The ink is read once for a pair: by fit, which comes first.
            let fresh = || {
                if name == "fit" {
                    Print::from(picture.clone())
                } else {
                    print.clone()
                }
            };
            b.iter_batched(fresh, |print| run(&print), BatchSize::LargeInput);
        });
        group.finish();
    };
    bench("fit", &mut |print| {
        drop(fit::fit(&mesh, Some(print), None, &settings.fit));
    });
    bench("depth", &mut |_| {
        drop(depth::depth(&mesh, &aligned.fit, None, &settings.depth));
    });
    bench("normalize", &mut |print| {
        drop(normalize::normalize(
            &aligned.depth,
            print,
            &settings.normalize,
        ));
    });
    bench("register", &mut |_| {
        drop(register::register(
            &aligned.depth,
            &aligned.normalized,
            &settings.register,
        ));
    });
    let mut whole = criterion.benchmark_group("pair");
    whole.bench_function(scan.size, |b| b.iter(|| pair(&stl, &png, &settings)));
    whole.finish();
    Ok(())
}

/// A pair from its files' bytes to its alignment.
fn pair(stl: &[u8], png: &[u8], settings: &Settings) -> anyhow::Result<Aligned> {
    let print = Print::from(decode(png)?);
    Ok(Aligned::new(&read(stl)?, &print, settings)?)
}

fn read(stl: &[u8]) -> anyhow::Result<Mesh> {
    Ok(mesh::read(stl, "scan.stl", &mesh::Limits::SUGGESTED)?)
}

fn decode(png: &[u8]) -> anyhow::Result<Picture> {
    Ok(raster::decode(png, &raster::Limits::SUGGESTED)?)
}

//! A print that shows neighbouring characters around the character of the pair.

use mocban::demo::{PairGenerator, Tier};
use mocban::mesh::write::MeshFormat;
use mocban::raster::{self, Grid, PrintImage};
use serde_json::Value;

use crate::cli::mocban;

/// Returns the print among eight neighbours in mirror writing.
fn among_neighbours(print: &PrintImage) -> Grid<[u8; 3]> {
    let [width, height] = [print.rgb.width(), print.rgb.height()];
    Grid::from_fn(3 * width, 3 * height, |x, y| {
        let is_middle = [x / width, y / height] == [1, 1];
        let column = if is_middle {
            x % width
        } else {
            width - 1 - x % width
        };
        let colour = print.rgb.at(column, y % height);
        colour.map(|channel| (channel >> 8) as u8)
    })
}

#[test]
fn part_of_the_print_is_stored_and_used_again() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let pair = PairGenerator::new(Tier::Upright, 31)
        .with_vertices(Some(20_000))
        .pair(0)
        .expect("a pair");
    let image = raster::decode(&pair.print, &raster::ImageLimits::SUGGESTED).expect("an image");
    let print = raster::png_rgb8(&among_neighbours(&image));
    std::fs::write(dir.path().join("a.png"), print).expect("a file");
    let mesh = MeshFormat::StlBinary.encode(&pair.mesh);
    std::fs::write(dir.path().join("a.stl"), mesh).expect("a file");
    std::fs::write(
        dir.path().join("list.csv"),
        "id,mesh,print\na,a.stl,a.png\n",
    )
    .expect("a file");
    let at = |args: &[&str]| mocban(dir.path(), &[&["-C", "grid"], args].concat());
    at(&["import", "list.csv"]).expect(0);
    let confidences = || -> Vec<f64> {
        let shown = at(&["show", "a", "--json"]).expect(0).json();
        let metrics = shown["metrics"].as_array().expect("a list").clone();
        let confidence = |metric: &Value| metric["confidence"].as_f64().expect("a number");
        metrics.iter().map(confidence).collect()
    };
    at(&["run"]).expect(0);
    assert!(
        confidences().iter().all(|c| *c > 0.5),
        "{:?}",
        confidences()
    );
    // The fit is not computed again, so normalize reads its stored result.
    let changed = ["--set", "normalize.character_px=180", "run", "--json"];
    let ran = at(&changed).expect(0).json();
    assert_eq!(ran["stages"], 2);
    assert!(
        confidences().iter().all(|c| *c > 0.5),
        "{:?}",
        confidences()
    );
}

//! Runs the examples of `examples/` on exports of a demo project. `READERS_PYTHON` names a Python
//! interpreter with the modules of `tests/readers/requirements.txt`, `TORCH_PYTHON` one with `torch` and `webdataset`.
//! Without them, the examples are skipped with a line on stderr.

use crate::readers::{exported_demo, output, python};

/// Returns the numbers after a word in each line that has it.
fn numbers_after(text: &str, word: &str) -> Vec<f64> {
    let rest = text.lines().filter_map(|line| line.split_once(word));
    let number = rest.map(|(_, rest)| rest.trim().split([' ', ',']).next().expect("a word"));
    number
        .map(|number| number.parse().expect("a number"))
        .collect()
}

#[test]
fn the_training_loop_learns_from_the_shards() {
    let Some(mut command) = python("TORCH_PYTHON", "examples/train.py") else {
        return;
    };
    let demo = exported_demo();
    let shards = demo.path("shards");
    let shards = shards.to_str().expect("UTF-8");
    let split = ["--split", "50/25/25", "--seed", "1"];
    let export = [
        "export",
        "--to",
        "webdataset",
        "--canvas",
        "96",
        "-o",
        shards,
    ];
    demo.call(&[&export[..], &split[..]].concat());
    let Some(text) = output(command.args([shards, "8"])) else {
        return;
    };
    let losses = numbers_after(&text, "loss ");
    let ious = numbers_after(&text, "blocks ");
    assert_eq!((losses.len(), ious.len()), (8, 8), "{text}");
    assert!(losses[7] < 0.8 * losses[0], "{text}");
    assert!(ious[7] > 0.3, "{text}");
}

#[test]
fn strokes_are_measured_in_mm() {
    let Some(mut command) = python("READERS_PYTHON", "examples/measure.py") else {
        return;
    };
    let export = exported_demo().path("export/fiji");
    let Some(text) = output(command.arg(export).arg("hard-0003")) else {
        return;
    };
    let rows = text.lines().skip(2).map(str::split_whitespace);
    let rows: Vec<Vec<f64>> = rows
        .map(|row| row.map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    assert!(!rows.is_empty(), "{text}");
    for row in &rows {
        let [_, area, width, wear] = row[..] else {
            panic!("{text}")
        };
        assert!(width > 0.0 && width * width <= 1.3 * area, "{text}");
        assert!((0.0..2.0).contains(&wear), "{text}");
    }
    assert!(rows.is_sorted_by(|a, b| a[1] >= b[1]), "{text}");
}

#[test]
fn the_figure_of_the_stages_is_drawn() {
    let Some(mut command) = python("READERS_PYTHON", "examples/stages.py") else {
        return;
    };
    let demo = exported_demo();
    let figure = demo.path("stages.png");
    command.arg(demo.path("export/jsonl")).arg("hard-0003");
    if output(command.arg(&figure)).is_some() {
        let drawn = image::open(&figure).expect("a picture").to_rgb8();
        let in_readme = image::open("docs/pictures/stages.png").expect("a picture");
        assert_eq!(drawn.dimensions(), (in_readme.width(), in_readme.height()));
        let paper = drawn.pixels().filter(|pixel| pixel.0 == [255; 3]).count();
        let all = drawn.width() * drawn.height();
        assert!(
            (0.1..0.9).contains(&(paper as f64 / f64::from(all))),
            "{paper} of {all}"
        );
    }
}

//! Scans in files that other programs wrote, from the file to the exported result.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use mocban::demo::{PairGenerator, Tier};

use crate::cli::{empty, mocban};
use crate::like_plain::{assert_like_first, export};
use crate::mesh_forms::{self, MeshForm};

/// Every form is aligned like its plain twin; the user learns of vertices without a position, and why other files are
/// refused.
#[test]
fn every_form_of_a_scan_is_aligned_like_its_plain_twin() {
    let dir = empty();
    let pairs = PairGenerator::new(Tier::Upright, 5).with_vertices(Some(12_000));
    let mut pair = pairs.pair(0).expect("images encode");
    // The coordinates of the file, so that all forms hold the same mesh.
    pair.mesh
        .vertices
        .map_in_place(|point| point.map(|value| f64::from(value as f32)));
    let groups = [
        mesh_forms::with_faces(&pair.mesh),
        mesh_forms::points(&pair.mesh),
    ];
    let refused = [
        (
            "pointer.stl",
            "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n",
            "does not hold the mesh; fetch the mesh with `git lfs pull`",
        ),
        (
            "scene.ply",
            "{\"asset\": {\"version\": \"2.0\"}}",
            "the file is a glTF scene; OBJ, PLY and STL meshes and XYZ points are read: open them in MeshLab",
        ),
    ];
    let print = format!("print.{}", pair.print_extension);
    fs::write(dir.path().join(&print), &pair.print).expect("written");
    let mut list = "id,mesh,print\n".to_owned();
    let all = groups
        .iter()
        .flatten()
        .map(|form| (form.name, &form.bytes[..]));
    for (name, bytes) in all.chain(refused.map(|(name, text, _)| (name, text.as_bytes()))) {
        fs::write(dir.path().join(name), bytes).expect("written");
        list.extend([name, ",", name, ",", &print, "\n"]);
    }
    fs::write(dir.path().join("pairs.csv"), list).expect("written");
    mocban(dir.path(), &["-C", "p", "import", "pairs.csv"]).expect(0);
    let run = mocban(dir.path(), &["-C", "p", "--progress", "none", "run", "-v"]).expect(3);
    for (name, _, sentence) in refused {
        let shown = mocban(dir.path(), &["-C", "p", "show", name]).expect(0).out;
        assert!(shown.contains(sentence), "{name}: {shown}");
    }
    export(dir.path());
    for forms in &groups {
        let names: Vec<&str> = forms.iter().map(|form| form.name).collect();
        assert_like_first(dir.path(), &names, &pair.truth, "ensemble", &run.err);
        for form in forms {
            assert_says_losses(dir.path(), form, &run.err);
        }
    }
}

/// The log of the run and `show` say once what was left out.
fn assert_says_losses(dir: &Path, form: &MeshForm, log: &str) {
    let name = form.name;
    let shown = mocban(dir, &["-C", "p", "show", name]).expect(0).out;
    for (text, number) in [
        (
            "vertices without a position (NaN, infinite, above 1e15, repeated 0 0 0 or a repeated number far outside) were left out with their faces",
            form.missing,
        ),
        (
            "faces with fewer than three corners were left out",
            form.incomplete,
        ),
    ] {
        let sentence = format!("{text}: {number}");
        let of_form = log.lines().filter(|line| line.contains(name));
        let warnings = of_form.filter(|line| line.contains(&sentence)).count();
        let expected = usize::from(number > 0);
        assert_eq!(warnings, expected, "{name}: {log}");
        assert_eq!(
            shown.matches(&sentence).count(),
            expected,
            "{name}: {shown}"
        );
    }
}

/// A list of scans in a format that is not read gets one sentence when it is imported.
#[test]
fn scans_of_another_format_are_refused_when_their_folder_is_imported() {
    let dir = empty();
    for name in ["scans/a.glb", "scans/b.glb", "scans/c.off", "prints/a.png"] {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, "").expect("written");
    }
    let import = [
        "-C", "p", "import", "--meshes", "scans", "--prints", "prints",
    ];
    let refused = mocban(dir.path(), &import).expect(2).err;
    for sentence in [
        "a glTF scene is not read: scans/a.glb and 1 more; open",
        "an OFF mesh is not read: scans/c.off; open",
    ] {
        assert_eq!(refused.matches(sentence).count(), 1, "{refused}");
    }
}

/// A list of such scans is refused with one sentence, and a run says once why pairs of a mixed list fail.
#[test]
fn scans_of_another_format_are_refused_or_named_once_when_a_list_has_them() {
    const SCANS: usize = 60;
    let dir = empty();
    let mut list = "id,mesh,print\n".to_owned();
    for number in 0..SCANS {
        fs::write(dir.path().join(format!("{number}.glb")), "glTF\u{2}\0\0\0").expect("written");
        writeln!(list, "b-{number},{number}.glb,page.pdf").expect("a String takes any text");
    }
    for name in ["page.pdf", "a.stl", "a.png"] {
        fs::write(dir.path().join(name), "").expect("written");
    }
    fs::write(dir.path().join("pairs.csv"), &list).expect("written");
    let import = ["-C", "p", "import", "pairs.csv"];
    let sentences = [
        "a glTF scene is not read: 0.glb and 59 more; open",
        "a PDF document is not read: page.pdf; open",
    ];
    let refused = mocban(dir.path(), &import).expect(2).err;
    for sentence in sentences {
        assert_eq!(refused.matches(sentence).count(), 1, "{refused}");
    }
    assert!(refused.contains("nothing was imported"), "{refused}");
    fs::write(dir.path().join("pairs.csv"), list + "a,a.stl,a.png\n").expect("written");
    let imported = mocban(dir.path(), &import).expect(0).err;
    for sentence in sentences {
        let warning = format!("warning: {sentence}");
        assert_eq!(imported.matches(&warning).count(), 1, "{imported}");
    }
    let failed_lines = |args: &[&str]| {
        let args = [&["-C", "p", "run", "--progress", "plain"], args].concat();
        let err = mocban(dir.path(), &args).expect(3).err;
        let failed = err.lines().filter_map(|line| line.strip_prefix("failed "));
        let more = failed.clone().filter_map(|line| {
            let (number, _) = line.split_once(" more like this one")?;
            number.parse::<usize>().ok()
        });
        let is_pair = |line: &&str| line.contains(" at fit: ") && !line.contains(" more like ");
        let shown = failed.filter(is_pair).count();
        ([shown, more.sum()], err)
    };
    let ([shown, more], err) = failed_lines(&[]);
    assert_eq!(shown + more, SCANS + 1, "{err}");
    assert!(shown < SCANS / 2, "{err}");
    let (all, err) = failed_lines(&["--rerun", "failed", "-v"]);
    assert_eq!(all, [SCANS + 1, 0], "{err}");
}

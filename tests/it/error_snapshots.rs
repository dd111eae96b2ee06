//! Snapshots of error messages: command line, settings, lists, and a project in use.

use crate::cli::empty;
use crate::snapshots::{TWO_PAIRS, assert_call, imported, write};

#[test]
fn usage_errors() {
    let dir = empty();
    for (name, args) in [
        ("unknown_command", &["staus"] as &[&str]),
        ("unknown_flag", &["run", "--dryrun"]),
        ("jobs_out_of_range", &["run", "--jobs", "0"]),
        ("memory_without_number", &["run", "--memory", "4GB"]),
        ("unknown_stage", &["run", "--stage", "align"]),
        (
            "unknown_verdict",
            &["verdict", "set", "a", "maybe", "--reviewer", "lan"],
        ),
        ("verdict_without_reviewer", &["verdict", "set", "a", "pass"]),
        (
            "unknown_order",
            &["review", "--reviewer", "lan", "--order", "risk"],
        ),
        ("fail_under_out_of_range", &["report", "--fail-under", "98"]),
        ("no_project", &["status"]),
        ("no_project_json", &["status", "--json"]),
        ("missing_manifest", &["import", "pairs.csv"]),
        (
            "missing_folder",
            &["import", "--meshes", "quét", "--prints", "in"],
        ),
        ("manifest_is_a_directory", &["import", "."]),
    ] {
        assert_call(&format!("error_{name}"), dir.path(), args);
    }
}

#[test]
fn wrong_projects_and_outputs() {
    let dir = imported();
    write(dir.path(), "khối-4.txt", "a file");
    std::fs::rename(dir.path().join("p"), dir.path().join("khối-4")).expect("renamed");
    for (name, args) in [
        (
            "project_is_a_file",
            &["-C", "khối-4.txt", "status"] as &[&str],
        ),
        ("project_misspelt", &["-C", "khoi_4", "status"]),
        ("project_forgotten", &["status"]),
        ("project_as_command", &["khối-4", "status"]),
        (
            "output_among_results",
            &["-C", "khối-4", "report", "-o", "khối-4/artifacts/r.html"],
        ),
        (
            "export_to_a_file",
            &["-C", "khối-4", "export", "-o", "khối-4.txt"],
        ),
        (
            "id_without_quotes",
            &[
                "-C",
                "khối-4",
                "verdict",
                "set",
                "chữ",
                "1",
                "pass",
                "--reviewer",
                "lan",
            ],
        ),
        ("import_of_nothing", &["import"]),
    ] {
        assert_call(&format!("error_{name}"), dir.path(), args);
    }
}

#[test]
fn settings_errors() {
    let dir = empty();
    for (name, set) in [
        ("unknown_setting", "run.wrokers=2"),
        ("unknown_section", "runs.workers=2"),
        ("setting_out_of_range", "run.workers=4096"),
        ("setting_of_wrong_type", "run.workers=many"),
        ("setting_without_section", "workers=2"),
    ] {
        let args = ["config", "show", "--set", set];
        assert_call(&format!("error_{name}"), dir.path(), &args);
    }
    write(dir.path(), "mocban.toml", "preset = \"papr\"\n");
    assert_call("error_unknown_preset", dir.path(), &["config", "show"]);
    write(dir.path(), "mocban.toml", "[run]\nworkers 2\n");
    assert_call("error_settings_syntax", dir.path(), &["config", "show"]);
    let missing = ["config", "show", "--config", "papr.toml"];
    assert_call("error_missing_settings_file", dir.path(), &missing);
}

#[test]
fn refused_manifests() {
    let dir = empty();
    for (name, text) in [
        (
            "manifest_rows",
            "id,mesh,print,unit\na,m,p,\na,m,p,\na/b,m,p,\n,m,p,\nc,,p,furlong\nd,m\n",
        ),
        ("manifest_columns", "id,model,print\na,b,c\n"),
        ("manifest_empty", ""),
        (
            "manifest_swapped",
            "id,mesh,print\na,a.png,a.stl\nb,b.png,b.stl\n",
        ),
        (
            "manifest_of_windows",
            "id,mesh,print\na,C:\\scans\\a.stl,C:/prints/a.png\nb,\\\\nas\\b.stl,pairs.csv\n",
        ),
    ] {
        write(dir.path(), "pairs.csv", text);
        let args = ["-C", "p", "import", "pairs.csv"];
        assert_call(&format!("error_{name}"), dir.path(), &args);
    }
    write(
        dir.path(),
        "pairs.jsonl",
        "{\"id\":\"a\",\"mesh\":\"m\"}\n[1]\n",
    );
    let args = ["-C", "p", "import", "pairs.jsonl"];
    assert_call("error_manifest_json_lines", dir.path(), &args);
    write(dir.path(), "pairs.csv", TWO_PAIRS);
    write(dir.path(), "truth.jsonl", "{\"id\":\"z\"}\n");
    let args = ["-C", "p", "import", "pairs.csv", "--truth", "truth.jsonl"];
    assert_call("error_truth_file", dir.path(), &args);
}

#[test]
fn project_in_use() {
    let dir = imported();
    let lock = std::fs::File::create(dir.path().join("p/run.lock")).expect("a lock file");
    lock.lock().expect("nobody else has it");
    for (name, command) in [
        ("run", &["run"] as &[&str]),
        ("repair", &["check", "--repair"]),
    ] {
        let args = [&["-C", "p"], command].concat();
        assert_call(&format!("error_{name}_in_use"), dir.path(), &args);
    }
}

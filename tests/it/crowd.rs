//! Many hostile pairs with a few good pairs among them. Each hostile pair is reported in one sentence and stops no
//! other pair. The good pairs have the same results as in a run without hostile pairs. `MOCBAN_HOSTILE` sets the number
//! of hostile pairs.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use mocban::demo::{DemoOptions, Tier, write_dataset};
use mocban::manifest::{ManifestRow, parse_csv};
use serde_json::Value;

use crate::check::below;
use crate::cli::{Call, binary, empty, mocban};
use crate::hostile_pairs::{HostilePair, HostilePairs};
use crate::sample_files::assert_one_sentence;
use crate::test_size::size_from_env;

/// Number of good pairs among the hostile ones.
const GOOD: u64 = 2;
/// Memory limit of a run in MiB. Peak memory must stay below it, although some headers declare far more data.
const MEMORY_MIB: u64 = 256;
/// Time limit of a stage in seconds, for a busy machine.
const STAGE_LIMIT_S: u64 = 600;

fn good_pairs(dir: &Path) -> Vec<ManifestRow> {
    let options = DemoOptions {
        pairs: GOOD,
        seed: 5,
        tier: Tier::Upright,
    };
    let files = write_dataset(dir, &options, &|| false).expect("a dataset");
    parse_csv(&fs::read(files.manifest).expect("a manifest")).expect("rows")
}

/// Writes two manifests: one of the good pairs spread among the hostile pairs, and one of the good pairs alone.
fn write_lists(dir: &Path, hostile: &[HostilePair]) {
    let good = good_pairs(dir);
    let row = |id: &str, mesh: &Path, print: &Path| {
        format!("{id},{},{}\n", mesh.display(), print.display())
    };
    let (mut crowd, mut alone) = (
        String::from("id,mesh,print\n"),
        String::from("id,mesh,print\n"),
    );
    let each = hostile.len() / good.len() + 1;
    for (group, good) in hostile.chunks(each).zip(&good) {
        crowd.extend(
            group
                .iter()
                .map(|pair| row(&pair.id, &pair.mesh, &pair.print)),
        );
        let good = row(good.name.as_str(), &good.mesh, &good.print);
        crowd += &good;
        alone += &good;
    }
    fs::write(dir.join("crowd.csv"), crowd).expect("written");
    fs::write(dir.join("alone.csv"), alone).expect("written");
}

/// Runs the binary. Returns its exit code and streams, and its peak memory in KiB.
///
/// On a busy machine, glibc keeps up to 100 MiB of freed memory, because each thread frees into its own arena. The
/// program cannot see this memory. Large blocks are therefore returned to the kernel as soon as they are freed.
pub(crate) fn watched(dir: &Path, args: &[&str]) -> (Call, u64) {
    let mut command = binary();
    command
        .env("MALLOC_MMAP_THRESHOLD_", "262144")
        .env("MALLOC_TRIM_THRESHOLD_", "262144")
        .current_dir(dir)
        .args(args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    let status = PathBuf::from(format!("/proc/{}/status", child.id()));
    let mut streams = (
        child.stdout.take().expect("piped"),
        child.stderr.take().expect("piped"),
    );
    let read = |stream: &mut dyn std::io::Read| {
        let mut text = String::new();
        stream.read_to_string(&mut text).expect("UTF-8");
        text
    };
    std::thread::scope(|scope| {
        let out = scope.spawn(|| read(&mut streams.0));
        let err = scope.spawn(|| read(&mut streams.1));
        let mut peak = 0;
        let code = loop {
            // The peak is read repeatedly, because the kernel drops it when the process ends.
            peak = peak.max(peak_kib(&status).unwrap_or(0));
            if let Some(code) = child.try_wait().expect("waited for") {
                break code.code().expect("no signal");
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let (out, err) = (out.join().expect("read"), err.join().expect("read"));
        (Call { code, out, err }, peak)
    })
}

fn peak_kib(status: &Path) -> Option<u64> {
    let mut text = String::new();
    fs::File::open(status)
        .ok()?
        .read_to_string(&mut text)
        .ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.parse().ok()
}

/// Returns the lines of an export by pair, in their order.
fn lines(export: &Path) -> BTreeMap<String, Vec<Value>> {
    let text = fs::read_to_string(export.join("pairs.jsonl")).expect("an export");
    let mut lines: BTreeMap<String, Vec<Value>> = BTreeMap::new();
    for line in text.lines() {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        // The inputs of the projects that are compared lie in different folders.
        line["mesh"].take();
        line["print"].take();
        let id = line["id"].as_str().expect("an id").to_owned();
        lines.entry(id).or_default().push(line);
    }
    lines
}

/// Asserts that neither stream contains text of a panic, Rust debug output or SQLite codes.
#[track_caller]
fn assert_plain(call: &Call) {
    for stream in [&call.out, &call.err] {
        for word in [
            "panicked",
            "RUST_BACKTRACE",
            "unwrap()",
            "Os {",
            "stack backtrace",
            "SQLITE_",
        ] {
            let line = stream.lines().find(|line| line.contains(word));
            assert!(line.is_none(), "{line:?}");
        }
    }
}

/// Asserts that the error is one sentence that names a file of the pair, and that its class is not the class for bugs.
fn assert_reported(pair: &HostilePair, line: &Value) {
    let (class, message) = (
        &line["error_class"],
        line["error"].as_str().unwrap_or_default(),
    );
    assert_one_sentence(message);
    for word in ["panicked", "Error(", "Os {", "took longer", "workers died"] {
        assert!(!message.contains(word), "{}: {message}", pair.id);
    }
    assert!(
        ["bad_input", "no_solution", "io"]
            .iter()
            .any(|known| class == known),
        "{}: {class}: {message}",
        pair.id
    );
    let named = [&pair.mesh, &pair.print]
        .into_iter()
        .any(|path| message.contains(&*path.to_string_lossy()));
    assert!(named, "{}: {message}", pair.id);
}

/// Runs the good pairs alone in another project. Returns the folder of its export.
fn export_good_pairs(dir: &Path) -> PathBuf {
    mocban(dir, &["-C", "clean", "import", "data/alone.csv"]).expect(0);
    mocban(dir, &["-C", "clean", "run"]).expect(0);
    mocban(dir, &["-C", "clean", "export", "-o", "clean-out"]).expect(0);
    dir.join("clean-out")
}

#[test]
fn many_hostile_pairs_are_reported_one_by_one_and_change_no_other_result() {
    let count = size_from_env("MOCBAN_HOSTILE", 240);
    let dir = empty();
    let data = dir.path().join("data");
    fs::create_dir(&data).expect("a folder");
    let mut generator = HostilePairs::new(&data, 4);
    let hostile: Vec<_> = (0..count).map(|_| generator.make()).collect();
    write_lists(&data, &hostile);

    let start = Instant::now();
    let (imported, import_kib) =
        watched(dir.path(), &["import", "data/crowd.csv", "--allow-missing"]);
    assert_plain(&imported.expect(0));
    let limit = format!("run.stage_timeout_s={STAGE_LIMIT_S}");
    let memory = format!("{MEMORY_MIB}M");
    let (ran, run_kib) = watched(dir.path(), &["--set", &limit, "run", "--memory", &memory]);
    assert_plain(&ran.expect(3));
    let elapsed = start.elapsed();
    assert!(run_kib >> 10 < MEMORY_MIB, "{} MiB", run_kib >> 10);

    let status = mocban(dir.path(), &["status", "--json"]).expect(0).json();
    let jobs = &status["jobs"];
    let done = jobs["done"].as_u64().expect("a number");
    let quarantined = jobs["quarantined"].as_u64().expect("a number");
    assert_eq!(done + quarantined, count as u64 + GOOD, "{jobs}");
    for command in [
        &["status"][..],
        &["report"],
        &["show", "h-00000"],
        &["run", "--dry-run"],
    ] {
        assert_plain(&mocban(dir.path(), command).expect(0));
    }
    assert_plain(&mocban(dir.path(), &["export", "-o", "out"]).expect(0));
    mocban(dir.path(), &["check"]).expect(0);

    let out = dir.path().join("out");
    let exported = lines(&out);
    let mut classes: BTreeMap<String, u64> = BTreeMap::new();
    for pair in &hostile {
        let line = &exported[&pair.id][0];
        if line["status"] == "done" {
            continue;
        }
        assert_reported(pair, line);
        *classes.entry(line["error_class"].to_string()).or_default() += 1;
    }
    let clean = export_good_pairs(dir.path());
    for (id, line) in lines(&clean) {
        assert_eq!(exported[&id], line);
        let folder = Path::new("pairs").join(&id);
        let (among, alone) = (below(&out.join(&folder)), below(&clean.join(&folder)));
        let names = |files: &[(PathBuf, Vec<u8>)]| {
            files.iter().map(|file| file.0.clone()).collect::<Vec<_>>()
        };
        assert_eq!(names(&among), names(&alone), "{id}");
        for (among, alone) in among.iter().zip(&alone) {
            assert!(among == alone, "{id}: {}", alone.0.display());
        }
    }
    eprintln!(
        "{count} hostile pairs in {:.1} s: {done} done, {classes:?}; peak {} MiB in import, {} MiB in run",
        elapsed.as_secs_f64(),
        import_kib >> 10,
        run_kib >> 10
    );
}

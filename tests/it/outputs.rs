//! Outputs of commands: folders are made, and a project's own files are never an output.

use std::path::Path;
use std::process::Command;

use crate::block_view::import_block;
use crate::browser::Browser;
use crate::check::{at, done};
use crate::cli::{binary, empty, mocban};
use crate::page::Page;
use crate::waiting::PATIENT;

#[test]
fn every_command_makes_the_folder_of_its_output() {
    let dir = empty();
    let project = done(dir.path());
    let new = |name: &str| dir.path().join("new").join(name).display().to_string();
    for (args, file) in [
        (&["report", "-o"][..], "a/report.html"),
        (&["contact-sheet", "-o"], "b/sheet.png"),
        (&["export", "-o"], "c/out"),
        (&["backup"], "d/b.sqlite"),
        (&["backup", "-o"], "e/b.sqlite"),
        (&["docs"], "f/docs"),
        (&["docs", "-o"], "g/docs"),
        (&["man"], "h/man"),
        (&["man", "-o"], "i/man"),
        (&["completions", "bash", "-o"], "j/mocban"),
        (&["status", "--log-file"], "k/log.txt"),
    ] {
        let output = new(file);
        at(&project, &[args, &[output.as_str()]].concat()).expect(0);
        assert!(Path::new(&output).exists(), "{output}");
    }
    // Commands that make a project or need none.
    let project = project.dir().display().to_string();
    let input = |name: &str| format!("{project}/data/{name}");
    let [mesh, print] = ["meshes/upright-0000.ply", "prints/upright-0000.jpg"].map(input);
    let list = input("manifest.csv");
    let [demo, align, restored, imported, backup] = [
        "l/demo",
        "m/align",
        "n/restored",
        "o/imported",
        "e/b.sqlite",
    ]
    .map(new);
    for (args, output) in [
        (&["demo", "--pairs", "1", "--no-run", &demo][..], &demo),
        (&["align", &mesh, &print, "-o", &align], &align),
        (&["restore", &backup, &restored], &restored),
        (&["-C", &imported, "import", &list], &imported),
    ] {
        mocban(dir.path(), args).expect(0);
        assert!(Path::new(output).exists(), "{output}");
    }
}

#[test]
fn files_of_a_project_are_never_an_output() {
    let dir = empty();
    let project = done(dir.path());
    let own = |name: &str| project.dir().join(name).display().to_string();
    for name in [
        "catalog.sqlite",
        "mocban.toml",
        "run.lock",
        "run.members",
        "empty-import.txt",
        "saved-views.json",
        "artifacts/x.html",
        "artifacts",
    ] {
        let output = own(name);
        for args in [
            &["report", "-o"][..],
            &["contact-sheet", "-o"],
            &["export", "-o"],
            &["backup", "-o"],
            &["align", "a.ply", "a.png", "-o"],
            &["docs", "-o"],
            &["man", "-o"],
            &["completions", "zsh", "-o"],
            &["status", "--log-file"],
        ] {
            let refused = at(&project, &[args, &[output.as_str()]].concat()).expect(2);
            assert!(refused.err.contains("project"), "{args:?}: {}", refused.err);
        }
    }
    assert!(!project.dir().join("artifacts/x.html").exists());
    let backup = dir.path().join("b.sqlite").display().to_string();
    at(&project, &["backup", &backup]).expect(0);
    let list = dir.path().join("pairs.csv").display().to_string();
    std::fs::write(&list, "id,mesh,print\na,a.stl,a.png\n").expect("written");
    let new = own("artifacts/new");
    for args in [
        &["demo", &new, "--pairs", "1"][..],
        &["restore", &backup, &new],
        &["-C", &new, "import", &list, "--allow-missing"],
        &["copy", &own(""), &new],
    ] {
        let refused = mocban(dir.path(), args).expect(2);
        let reason = "artifacts/new belongs to the results of a project; name another folder";
        assert!(refused.err.contains(reason), "{args:?}: {}", refused.err);
    }
    assert!(!Path::new(&new).exists());
    at(&project, &["check"]).expect(0);
}

#[test]
fn files_of_other_programs_are_no_scripts_and_no_logs() {
    let dir = empty();
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(dir.path().join(name), bytes).expect("written");
    };
    write("a.stl", b"solid a");
    write("scan", b"\x89PNG\r\n\x1a\n");
    write(".zshrc", b"source <(mocban completions zsh)\n");
    for (args, reason) in [
        (
            ["completions", "zsh", "-o", "a.stl"],
            "is not a completion script for zsh",
        ),
        (
            ["completions", "zsh", "-o", ".zshrc"],
            "is not a completion script for zsh",
        ),
        (
            ["config", "show", "--log-file", "a.stl"],
            "is not a log file of this program",
        ),
        (
            ["config", "show", "--log-file", "scan"],
            "is not a log file of this program",
        ),
    ] {
        let name = args[3];
        let before = std::fs::read(dir.path().join(name)).expect("a file");
        let refused = mocban(dir.path(), &args).expect(2);
        assert!(refused.err.contains(reason), "{args:?}: {}", refused.err);
        let after = std::fs::read(dir.path().join(name)).expect("a file");
        assert_eq!(after, before, "{args:?}");
    }
    // A script with another line is kept.
    let script = dir.path().join("changed");
    let complete = || mocban(dir.path(), &["completions", "bash", "-o", "changed"]);
    complete().expect(0);
    let mut changed = std::fs::read_to_string(&script).expect("a script");
    changed += "alias m=mocban\n";
    std::fs::write(&script, &changed).expect("written");
    let refused = complete().expect(2);
    let said = "changed is a completion script for bash that somebody changed";
    assert!(refused.err.contains(said), "{}", refused.err);
    assert_eq!(std::fs::read_to_string(&script).ok(), Some(changed));
    // An earlier script and an earlier log stay in use.
    for _ in 0..2 {
        for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
            mocban(dir.path(), &["completions", shell, "-o", shell]).expect(0);
        }
        for format in ["text", "json"] {
            let args = [
                "config",
                "show",
                "--log-file",
                format,
                "--log-format",
                format,
                "-vv",
            ];
            mocban(dir.path(), &args).expect(0);
        }
    }
    mocban(dir.path(), &["completions", "bash", "-o", "fish"]).expect(2);
}

#[test]
fn reports_sheets_and_logs_replace_only_their_own_earlier_files() {
    let dir = empty();
    let project = done(dir.path());
    let path = |name: &str| dir.path().join(name).display().to_string();
    let [list, truth] = ["manifest.csv", "truth.jsonl"]
        .map(|name| project.dir().join("data").join(name).display().to_string());
    let page = path("page.png");
    std::fs::write(&page, b"\x89PNG\r\n\x1a\n").expect("written");
    let notes = path("notes.txt");
    std::fs::write(&notes, "my notes\n").expect("written");
    for (args, output) in [
        (&["report", "--format", "csv", "-o"][..], &list),
        (&["report", "--format", "json", "-o"], &truth),
        (&["report", "-o"], &notes),
        (&["contact-sheet", "-o"], &page),
        (&["status", "--log-file"], &list),
        (&["status", "--log-file"], &notes),
    ] {
        let before = std::fs::read(output).expect("a file");
        let refused = at(&project, &[args, &[output.as_str()]].concat()).expect(2);
        let reason = "of this program; choose another name, or remove it if you do not need it";
        let is_said = refused.err.contains(reason);
        assert!(is_said, "{args:?}: {}", refused.err);
        assert_eq!(std::fs::read(output).expect("a file"), before, "{args:?}");
    }
    let [report, sheet] = [path("report.md"), path("sheet.png")];
    for _ in 0..2 {
        at(&project, &["report", "-o", &report]).expect(0);
        at(&project, &["contact-sheet", "-o", &sheet]).expect(0);
    }
    at(&project, &["report", "--format", "text", "-o", &report]).expect(0);
    at(&project, &["report", "-o", &sheet]).expect(2);
}

#[test]
fn reports_that_somebody_changed_are_kept_and_named() {
    let dir = empty();
    let project = done(dir.path());
    let [changed, added] = ["that somebody changed", "to which somebody added text"];
    for (name, middle) in [
        ("a.md", Some(changed)),
        ("a.tex", Some(changed)),
        ("a.html", Some(changed)),
        ("a.csv", None),
        ("a.txt", None),
    ] {
        let path = dir.path().join(name);
        let output = path.display().to_string();
        let report = || at(&project, &["report", "-o", &output]);
        report().expect(0);
        let written = std::fs::read_to_string(&path).expect("a report");
        report().expect(0);
        // Git may change the ends of lines.
        let saved = written.replace('\r', "").replace('\n', "\r\n");
        std::fs::write(&path, saved).expect("written");
        report().expect(0);
        let continued = format!("{written}seen by lan\n");
        let mut edits = vec![(continued, middle.unwrap_or(added))];
        if name == "a.txt" {
            edits.push((format!("seen by lan\n\n{written}"), added));
            edits.push((format!("{written}              seen by lan\n"), added));
        }
        if let Some(said) = middle {
            let at = written.rfind("mocban 0.").expect("the version");
            let (before, after) = written.split_at(at);
            edits.push((format!("{before}{}", after.replacen("0.", "7.", 1)), said));
        }
        for (content, said) in edits {
            std::fs::write(&path, &content).expect("written");
            let refused = report().expect(2);
            let said = format!("{name} is a report {said}");
            assert!(refused.err.contains(&said), "{name}: {}", refused.err);
            let kept = std::fs::read_to_string(&path).expect("a report");
            assert!(kept == content, "{name}");
        }
    }
}

#[test]
fn a_contact_sheet_that_somebody_changed_is_kept_and_named() {
    let dir = empty();
    let project = done(dir.path());
    let path = dir.path().join("sheet.png");
    let output = path.display().to_string();
    let sheet = || at(&project, &["contact-sheet", "-o", &output]);
    for _ in 0..2 {
        sheet().expect(0);
    }
    let mut edited = std::fs::read(&path).expect("a sheet");
    let middle = edited.len() / 2;
    edited[middle] ^= 1;
    std::fs::write(&path, &edited).expect("written");
    let refused = sheet().expect(2);
    let said = "sheet.png is a contact sheet that somebody changed after it was written; choose";
    assert!(refused.err.contains(said), "{}", refused.err);
    assert!(edited == std::fs::read(&path).expect("a sheet"));
}

#[test]
fn files_of_a_block_are_never_an_output() {
    let dir = empty();
    import_block(dir.path());
    for (name, reason) in [
        ("d/data/page.jpg", "cannot be written as jpg"),
        ("d/data/block.ply", "is an input of b1"),
        ("few.json", "is an input of b1"),
    ] {
        let refused = mocban(dir.path(), &["-C", "p", "report", "-o", name]).expect(2);
        assert!(refused.err.contains(reason), "{}", refused.err);
    }
}

#[test]
fn equal_warnings_are_a_few_with_a_count() {
    let dir = empty();
    let demo = [
        "demo",
        "p",
        "--pairs",
        "6",
        "--set",
        "depth.longest_px=96",
        "-q",
    ];
    mocban(dir.path(), &demo).expect(0);
    for print in std::fs::read_dir(dir.path().join("p/data/prints")).expect("prints") {
        let path = print.expect("a print").path();
        let bytes = std::fs::read(&path).expect("read");
        std::fs::write(&path, [&bytes[..], b"x"].concat()).expect("written");
    }
    let export = ["-C", "p", "--progress", "none", "export", "-o", "out"];
    let lost = mocban(dir.path(), &export).expect(3);
    let warnings: Vec<&str> = lost
        .err
        .lines()
        .filter(|line| line.starts_with("warning:"))
        .collect();
    assert_eq!(warnings.len(), 4, "{}", lost.err);
    assert!(warnings[0].contains("upright-0000"), "{}", lost.err);
    assert_eq!(warnings[3], "warning: 3 more like this one; -v shows all");
    let all = mocban(dir.path(), &[&export[..], &["-v"]].concat()).expect(3);
    assert!(all.err.contains("no files of upright-0005"), "{}", all.err);
}

/// Returns what bash completes after the words of a command line, of which the last one is not finished.
fn bash_completes(dir: &Path, words: &str) -> String {
    let program = binary().get_program().to_owned();
    let script = format!(
        "source <(\"$0\" completions bash)\nmocban() {{ \"$0\" \"$@\"; }}\nCOMP_WORDS=({words})\n\
         COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))\n_mocban_with_names mocban \"${{COMP_WORDS[COMP_CWORD]}}\"\n\
         printf '%s\\n' \"${{COMPREPLY[@]}}\""
    );
    let mut bash = Command::new("bash");
    bash.args(["-c", &script])
        .arg(program)
        .current_dir(dir)
        .env("LC_ALL", "C.UTF-8")
        .envs([PATIENT]);
    let output = bash.output().expect("bash starts");
    assert!(
        output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn bash_completes_the_names_of_pairs() {
    let dir = empty();
    let list = "id,mesh,print\nb04-0117,a.stl,a.png\nb04-0118,a.stl,a.png\nchữ 1,a.stl,a.png\n";
    std::fs::write(dir.path().join("pairs.csv"), list).expect("written");
    let import = ["-C", "p", "-q", "import", "pairs.csv", "--allow-missing"];
    mocban(dir.path(), &import).expect(0);
    let complete = |words: &str| bash_completes(dir.path(), words);
    assert_eq!(complete("mocban -C p show b04"), "b04-0117\nb04-0118\n");
    assert_eq!(complete("mocban -C p view chữ"), "chữ\\ 1\n");
    assert!(complete("mocban -C p sho").contains("show"));
    // Where there is no project, or no name, the options and commands are completed without an error.
    assert!(complete("mocban show --lo").contains("--low"));
    complete("mocban show b04");
}

#[test]
fn pages_have_the_language_that_is_asked_for() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = empty();
    done(dir.path());
    for (args, lang, expected) in [
        (&["--lang", "vi"][..], "C", "Từ gỗ đến mực"),
        (&[], "vi_VN.UTF-8", "Từ gỗ đến mực"),
        (&["--lang", "en"], "vi_VN.UTF-8", "Wood to ink"),
        (&[], "C", "Wood to ink"),
    ] {
        let view = ["-C", "p", "--json", "view", "--no-open", "upright-0000"];
        let mut command = binary();
        command
            .current_dir(dir.path())
            .env_remove("LC_ALL")
            .env_remove("LC_MESSAGES");
        let page = Page::of(command.env("LANG", lang).args(view).args(args));
        let tab = browser.tab(900, 900);
        tab.open(&page.url);
        tab.wait("window.mocbanViewer");
        tab.wait(&format!("document.body.textContent.includes('{expected}')"));
    }
}

#[test]
fn the_documentation_folds_and_searches() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = empty();
    mocban(dir.path(), &["docs", "-o", "docs"]).expect(0);
    let tab = browser.tab(400, 800);
    let page = dir.path().join("docs/tutorial/first-hour.html");
    tab.open(&format!("file://{}", page.display()));
    let contents = "getComputedStyle(document.getElementById('contents')).display";
    // The button works once the script of the page has run.
    tab.wait(&format!(
        "document.readyState === 'complete' && {contents} === 'none'"
    ));
    tab.screenshot("docs-phone");
    tab.eval("document.getElementById('contents-button').click(), null");
    tab.wait(&format!("{contents} !== 'none'"));
    tab.resize([1440, 900]);
    tab.wait(&format!("{contents} !== 'none'"));
    tab.eval("document.getElementById('search-text').focus(), null");
    tab.text("bao cao");
    tab.wait("document.querySelectorAll('#search-results a').length > 0");
    tab.screenshot("docs-search");
    // A search without marks finds words with marks.
    let found = tab.eval("document.getElementById('search-results').textContent");
    assert!(
        found.as_str().is_some_and(|text| text.contains("báo cáo")),
        "{found}"
    );
    tab.eval("document.querySelector('.translation a').click(), null");
    tab.wait("document.documentElement.lang === 'vi' && document.readyState === 'complete'");
    for page in ["ung-dung", "python", "thuat-ngu"] {
        tab.eval("document.querySelector('a[rel=next]').click(), null");
        tab.wait(&format!(
            "location.pathname.endsWith('{page}.html') && document.readyState === 'complete'"
        ));
    }
}

//! Files that a person chooses in a browser, through to stored pairs, and what the page of imports looks like meanwhile.

use std::path::{Path, PathBuf};

use crate::accessible::{axe, no_violation};
use crate::app::app;
use crate::app_browser::{enter, fits_width, looks_right};
use crate::browser::{Browser, Tab};
use crate::cli::{mocban, status};
use crate::page::{Page, read_project};
use crate::small_block::demo_block;
use crate::waiting::wait_until;

/// The page of imports can take files.
const READY: &str = "document.getElementById('upload')?.dataset.ready";

/// Copies two pairs of the shared project to a folder, under Vietnamese names.
fn pairs(dir: &Path, folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for (kind, ending) in [("meshes", "ply"), ("prints", "jpg")] {
        for (number, name) in ["chữ số 1", "khắc 二"].iter().enumerate() {
            let from = format!("p/data/{kind}/upright-000{number}.{ending}");
            let to = dir.join(folder).join(format!("{name}.{ending}"));
            std::fs::create_dir_all(dir.join(folder)).expect("a folder");
            std::fs::copy(dir.join(&from), &to).expect("copied");
            found.push(to);
        }
    }
    found
}

/// Packs files as a ZIP.
fn packed(files: &[PathBuf], to: &Path) {
    let script = "import sys, zipfile, os\nwith zipfile.ZipFile(sys.argv[1], 'w', zipfile.ZIP_DEFLATED) as z:\n    for f in sys.argv[2:]:\n        z.write(f, 'ván 4/' + os.path.basename(f))";
    let mut python = std::process::Command::new("python3");
    let packed = python.args(["-c", script]).arg(to).args(files).status();
    assert!(packed.expect("Python").success());
}

fn imported(dir: &Path, project: &str) -> u64 {
    status(&dir.join(project))["pairs"]
        .as_u64()
        .expect("a number")
}

/// Imports what the page shows into a project.
fn import(tab: &Tab<'_>, project: &str) {
    tab.eval(&format!(
        "document.querySelector('#project').value = '{project}', document.querySelector('#import').click(), null"
    ));
    tab.wait(&format!(
        "document.body?.dataset.ready && decodeURIComponent(location.pathname).endsWith('/p/{project}/')"
    ));
}

/// Looks at the page as it is, in both themes and two sizes.
fn look(tab: &Tab<'_>, axe: Option<&str>, what: &str) {
    for (size, dark) in [([1366, 660], false), ([400, 800], true)] {
        tab.resize(size);
        tab.dark(dark);
        fits_width(tab, what);
        let what = format!("app_{what}_{}", size[0]);
        if let Some(axe) = axe {
            no_violation(tab, axe, &what);
        }
    }
}

#[test]
fn files_and_a_zip_are_chosen_in_a_browser_and_become_pairs() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    let project = tempfile::tempdir().expect("a temporary directory");
    read_project(&project);
    let files = pairs(project.path(), "quét");
    let zip = project.path().join("ván 4.zip");
    packed(&files, &zip);
    let page = Page::of(app(dir).args(["--lang", "vi"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    let shown = "document.querySelector('#import') && location.search.includes('meshes')";
    for (chosen, project, folder) in [
        (files.as_slice(), "dự án 1", "files "),
        (std::slice::from_ref(&zip), "dự án 2", "ván 4"),
    ] {
        tab.open(&format!("{home}import"));
        tab.wait(READY);
        tab.choose_files("#upload-files", chosen);
        tab.wait(shown);
        tab.wait("document.body?.dataset.ready");
        look(&tab, axe.as_deref(), "import_pairs");
        let text = tab.eval("document.querySelector('dl.chosen').innerText");
        assert!(text.as_str().expect("text").contains(folder), "{text}");
        import(&tab, project);
        assert_eq!(imported(dir, project), 2);
    }
    let found = std::fs::read_dir(dir.join("uploads")).expect("a folder");
    assert_eq!(found.count(), 2, "two folders, nothing unfinished");
    // A whole folder.
    tab.open(&format!("{home}import"));
    tab.wait(READY);
    tab.choose_files("#upload-folder", &[project.path().join("quét")]);
    tab.wait(shown);
    assert!(dir.join("uploads/quét/chữ số 1.ply").is_file());
    // What was typed stays when another folder is opened.
    tab.wait("document.body?.dataset.ready");
    tab.eval("document.querySelector('#project').value = 'gõ rồi', document.querySelector(\"main tbody a[href*='path=']\").click(), null");
    tab.wait("document.body?.dataset.ready && location.search.includes('path=')");
    tab.wait("document.querySelector('#project')?.value === 'gõ rồi'");
    let problems = browser.take_problems();
    assert!(problems.is_empty(), "{problems:#?}");
}

#[test]
fn dragged_files_become_a_whole_block_with_a_name() {
    let Some(browser) = Browser::start() else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let source = tempfile::tempdir().expect("a temporary directory");
    demo_block(source.path());
    let files = ["block.ply", "page.jpg"].map(|name| source.path().join("d/data").join(name));
    let page = Page::of(app(dir.path()).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    tab.open(&format!("{home}import"));
    tab.wait(READY);
    tab.drop_files("#upload", &files);
    tab.wait("document.body?.dataset.ready && document.querySelector('#whole-block button')");
    tab.click("#whole-block button", false);
    tab.wait("document.body?.dataset.ready && location.search.includes('whole_block=yes')");
    tab.eval("document.querySelector('#block').value = 'Ván 7', null");
    import(&tab, "blocks");
    let shown = mocban(&dir.path().join("blocks"), &["show", "Ván 7", "--json"]);
    let shown = shown.expect(0).json();
    let mesh = shown["mesh_path"].as_str().expect("a path");
    assert!(mesh.ends_with("uploads/files block/block.ply"), "{mesh}");
    tab.open(&format!("{home}p/blocks/blocks"));
    tab.wait("document.body?.dataset.ready && document.querySelector('a[href^=\"block/\"]')");
    let listed = tab.eval("document.querySelector('a[href^=\"block/\"]').textContent");
    assert_eq!(listed, "Ván 7");
}

#[test]
fn an_upload_shows_its_progress_and_is_cancelled() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    let source = tempfile::tempdir().expect("a temporary directory");
    let files = ["1.stl", "1.png", "2.stl"].map(|name| {
        let file = source.path().join(name);
        std::fs::write(&file, "x".repeat(200_000)).expect("written");
        file
    });
    let hold = source.path().join("hold");
    let mut command = app(dir);
    command.args(["--lang", "en"]);
    command.env("MOCBAN_HOLD_AT", "upload:written:2");
    command.env("MOCBAN_HOLD_FILE", &hold);
    let page = Page::of(&mut command);
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    tab.open(&format!("{home}import"));
    tab.wait(READY);
    look(&tab, axe.as_deref(), "import_empty");
    tab.choose_files("#upload-files", &files);
    wait_until("the upload is held", || hold.exists());
    tab.wait("document.querySelector('#upload-done').textContent.startsWith('1 / 3 files')");
    tab.wait("document.querySelector('#upload progress').value >= 400000");
    look(&tab, axe.as_deref(), "import_sending");
    // Every control can be reached, and Enter presses it.
    tab.eval("document.querySelector('#upload-cancel').focus(), null");
    assert_eq!(tab.eval("document.activeElement.id"), "upload-cancel");
    tab.eval("document.querySelector('#upload-cancel').click(), null");
    tab.wait("document.querySelector('#upload-problem').textContent.includes('was cancelled')");
    assert_eq!(tab.eval("document.activeElement.id"), "upload-problem");
    std::fs::remove_file(&hold).expect("the upload waits");
    look(&tab, axe.as_deref(), "import_cancelled");
    let left = || {
        std::fs::read_dir(dir.join("uploads"))
            .expect("a folder")
            .count()
    };
    wait_until("no files are left", || left() == 0);
    tab.eval("document.querySelector('#upload-files').value = '', null");
    let other = source.path().join("notes.doc");
    std::fs::write(&other, "x").expect("written");
    tab.choose_files("#upload-files", &[other]);
    tab.wait("document.querySelector('#upload-problem').textContent.includes('None of the files')");
    let named = source.path().join("con.stl");
    std::fs::write(&named, "x").expect("written");
    tab.choose_files("#upload-files", &[named]);
    tab.wait(
        "document.querySelector('#upload-problem').textContent.includes('a device on Windows')",
    );
}

#[test]
fn pairs_are_mended_and_columns_named_in_a_browser() {
    let (axe, Some(browser)) = (axe(), Browser::start()) else {
        return;
    };
    let dir = tempfile::tempdir().expect("a temporary directory");
    let dir = dir.path();
    for file in ["a/chữ 1.stl", "a/chữ 1.png", "a/2.stl", "a/hai.png"] {
        let file = dir.join(file);
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("created");
        std::fs::write(file, "x").expect("written");
    }
    let list = "Nr;Model;Image\nn1;chữ 1.stl;chữ 1.png\nn2;2.stl;hai.png\n";
    std::fs::write(dir.join("a/list.csv"), list).expect("written");
    let page = Page::of(app(dir).args(["--lang", "en"]));
    let (tab, home) = enter(&browser, &page, [1366, 660]);
    let folder = dir.canonicalize().expect("a path").join("a");
    let folder = folder.to_str().expect("UTF-8");
    tab.open(&format!("{home}import?meshes={folder}&prints={folder}"));
    tab.wait("document.body?.dataset.ready && document.querySelector('#join')");
    tab.eval(
        "document.querySelector('#join [name=scan]').value = '2.stl', document.querySelector('#join [name=print]').value = 'hai.png', document.querySelector('#join').requestSubmit(), null",
    );
    tab.wait("document.body?.dataset.ready && document.querySelector('#changes li')");
    look(&tab, axe.as_deref(), "import_mended");
    tab.reload();
    tab.wait("document.body?.dataset.ready && document.querySelector('#changes li')");
    tab.eval("document.querySelector('td a').click(), null");
    tab.wait(
        "document.body?.dataset.ready && document.querySelectorAll('#changes li').length === 2",
    );
    import(&tab, "joined");
    assert_eq!(imported(dir, "joined"), 1);
    let address = format!("{home}import?list={folder}/list.csv");
    looks_right(&browser, &tab, "import_columns", &address, axe.as_deref());
    tab.eval("document.querySelector('.bar a[hreflang]').click(), null");
    tab.wait("document.body?.dataset.ready && document.documentElement.lang === 'vi'");
    look(&tab, axe.as_deref(), "import_columns_vi");
    tab.eval(
        "for (const [name, value] of [['id', 'Nr'], ['mesh', 'Model'], ['print', 'Image']]) document.querySelector(`[name=${name}_column]`).value = value",
    );
    tab.eval("document.querySelector('#columns form').requestSubmit(), null");
    tab.wait("document.body?.dataset.ready && document.querySelector('#import:enabled')");
    look(&tab, axe.as_deref(), "import_list_vi");
    import(&tab, "named");
    assert_eq!(imported(dir, "named"), 2);
    // A list with the same header, and the same list again.
    std::fs::write(dir.join("a/other.csv"), list.replace("n1", "n3")).expect("written");
    for name in ["other", "list"] {
        tab.open(&format!("{home}import?list={folder}/{name}.csv"));
        tab.wait("document.body?.dataset.ready && document.querySelector('#import:enabled')");
        let kept = tab.eval("document.querySelector('#kept-columns') !== null");
        assert_eq!(kept, true, "{name}");
        let id = tab.eval("document.querySelector('[name=id_column]').value");
        assert_eq!(id, "Nr", "{name}");
    }
}

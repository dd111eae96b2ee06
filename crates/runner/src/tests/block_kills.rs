//! Runs of blocks in processes that are killed at each point of a block's job.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

use super::fake_pairs::FakePairs;
use super::{RunFixture, options};
use crate::Stop;
use mocban_catalog::Catalog;
use mocban_core::domain::BlockStage;
use mocban_store::Project;

/// Names the project that a child process runs.
const CHILD_PROJECT: &str = "MOCBAN_TEST_PROJECT";

impl RunFixture {
    /// A project that exists already. It is not removed.
    async fn existing(dir: &Path) -> Self {
        let project = Project::open(dir).expect("a project");
        let catalog = Catalog::open(&project.catalog_path()).await;
        let pairs = FakePairs::default();
        let _ = pairs.project.set(project.clone());
        Self {
            project,
            catalog: catalog.expect("a catalog"),
            pairs: Arc::new(pairs),
            blocks: Arc::default(),
            stop: Stop::new(),
            events: Mutex::default(),
            _dir: None,
        }
    }
}

/// What a project holds after a run: results by block and stage, characters, pairs with results, and artifacts.
async fn content(project: &Project, catalog: &Catalog) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for state in catalog.block_states().await.expect("a read") {
        let name = &state.attributes.name;
        let detail = catalog.block(name).await.expect("a read").expect("a block");
        for stage in detail.stages {
            found.insert(
                format!("{name}/{}", stage.stage),
                stage.result_hash.to_hex(),
            );
        }
        let characters = catalog.block_characters(name).await.expect("a read");
        found.insert(format!("{name}/characters"), format!("{characters:?}"));
        found.insert(format!("{name}/status"), state.status.to_string());
    }
    for pair in catalog.pair_names().await.expect("a read") {
        let detail = catalog.pair(&pair).await.expect("a read").expect("a pair");
        let results = &detail.results;
        found.insert(
            pair.to_string(),
            format!("{} {:?}", results.status, results.attributes),
        );
        for stage in &results.stages {
            found.insert(
                format!("{pair}/{}", stage.stage),
                stage.result_hash.to_hex(),
            );
        }
    }
    for folder in std::fs::read_dir(project.artifacts_dir()).expect("a folder") {
        let folder = folder.expect("an entry").path();
        if folder.ends_with("owner.json") {
            continue;
        }
        for file in std::fs::read_dir(&folder).expect("a folder") {
            let path = file.expect("an entry").path();
            let bytes = std::fs::read_to_string(&path).expect("text");
            let name = path
                .strip_prefix(project.dir())
                .expect("a file of the project");
            found.insert(name.display().to_string(), bytes);
        }
    }
    found
}

#[tokio::test]
async fn a_process_that_is_killed_anywhere_leaves_a_block_that_another_run_finishes() {
    // This test is also the program of the processes that it kills.
    if let Some(dir) = std::env::var_os(CHILD_PROJECT) {
        let fixture = RunFixture::existing(Path::new(&dir)).await;
        fixture.run(&options(1)).await;
        return;
    }
    let labels = "r1 a\nr2 b";
    let whole = RunFixture::of_blocks(&["b_1"], labels).await;
    whole.run(&options(1)).await;
    let expected = content(&whole.project, &whole.catalog).await;
    let mut places = vec!["face:claiming".to_owned(), "face:claimed".to_owned()];
    for stage in BlockStage::ALL {
        for point in ["computed", "synced", "recorded", "committed"] {
            places.push(format!("{stage}:{point}"));
        }
        if stage != BlockStage::Boxes {
            places.push(format!("{stage}:written"));
        }
    }
    places.push("cut:written:4".to_owned());
    let test = concat!(
        module_path!(),
        "::a_process_that_is_killed_anywhere_leaves_a_block_that_another_run_finishes"
    );
    let (_, test) = test.split_once("::").expect("a path in the crate");
    for place in places {
        let fixture = RunFixture::of_blocks(&["b_1"], labels).await;
        let child = std::env::current_exe().expect("this program");
        let output = Command::new(child)
            .args(["--exact", test])
            .env(CHILD_PROJECT, fixture.project.dir())
            .env("MOCBAN_BREAK_AT", &place)
            .output()
            .expect("a child process");
        let code = output.status.code();
        assert_eq!(
            code,
            None,
            "{place}: {}",
            String::from_utf8_lossy(&output.stdout)
        );
        let summary = fixture.run(&options(1)).await;
        assert_eq!(summary.blocks.failed_in_all, 0, "{place}");
        assert_eq!((summary.left, summary.blocks.left), (0, 0), "{place}");
        let found = content(&fixture.project, &fixture.catalog).await;
        assert_eq!(found, expected, "{place}");
        assert_eq!(fixture.catalog.faulty_rows().await.expect("a read"), []);
    }
}

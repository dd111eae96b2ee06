//! Reads arbitrary text as a settings file, as `--set` and as environment variables: gives valid settings, or an error
//! that names the position.

#![no_main]

use std::path::PathBuf;
use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;
use mocban::config::{BaseLayer, Sources, load};

fn file() -> &'static PathBuf {
    static FILE: OnceLock<PathBuf> = OnceLock::new();
    FILE.get_or_init(|| {
        let dir = tempfile::tempdir_in("/dev/shm").expect("a directory in memory");
        dir.keep().join("mocban.toml")
    })
}

fn check(sources: &Sources) {
    match load(sources) {
        // Printed settings can be parsed again.
        Ok(loaded) => {
            let sets = loaded.tree.settings();
            let again = Sources {
                sets: sets
                    .iter()
                    .map(|setting| format!("{}={}", setting.key, setting.value))
                    .collect(),
                ..Sources::default()
            };
            let again = load(&again).expect("settings as shown");
            assert_eq!(again.config, loaded.config);
        }
        Err(error) => mocban_fuzz::one_sentence(&error.to_string()),
    }
}

fuzz_target!(|text: &str| {
    std::fs::write(file(), text).expect("written");
    check(&Sources {
        base: BaseLayer::File(file().clone()),
        ..Sources::default()
    });
    let lines = || text.lines().take(20);
    check(&Sources {
        sets: lines().map(str::to_owned).collect(),
        ..Sources::default()
    });
    let variable = |line: &str| {
        let (name, value) = line.split_once('=')?;
        let name = name.trim().replace('.', "__").to_uppercase();
        Some((format!("MOCBAN_{name}"), value.to_owned()))
    };
    check(&Sources {
        env: lines().filter_map(variable).collect(),
        ..Sources::default()
    });
});

//! Settings: reads, merges and validates them. Unknown keys are errors. Each value has an origin.
//!
//! A layer overrides all layers after it in this list: flags, environment variables, `--config` or the project's file,
//! the preset that this file names, and the embedded `config/default.toml`, which contains every setting.
//!
//! **Invariant:** every value has a type, a range and an origin, and no password is in any layer.

mod document;
mod edit;
mod error;
mod local;
mod passwords;
mod ranges;
mod sources;
mod tree;

pub use document::{Config, ReviewSettings, RunSettings, StorageSettings};
pub use edit::with_setting;
pub use error::{ConfigError, Origin};
pub use local::{LocalSettings, make_local};
pub use sources::{BaseLayer, Preset, Sources, explanation};
pub use tree::{Setting, Tree};

/// Settings ready for use, with the values they were made from.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The typed and checked settings.
    pub config: Config,
    /// Every value with its origin.
    pub tree: Tree,
}

/// Reads every layer, merges them and checks the result.
///
/// # Errors
/// Returns an error if a layer cannot be read, names an unknown setting, or gives a setting an invalid value.
pub fn load(sources: &Sources) -> Result<Loaded, ConfigError> {
    let defaults = Preset::Default.table()?;
    let mut tree = Tree::new(defaults);
    let mut changes = Vec::new();
    for (layer, origin) in sources.tables()? {
        changes.extend(tree.changes(&layer, &origin)?);
    }
    for (key, value, origin) in sources.single_values(&tree)? {
        changes.extend(tree.change(&key, value, &origin)?);
    }
    // First, because errors quote values.
    changes.iter().try_for_each(passwords::refuse)?;
    for change in &changes {
        tree.apply(change);
    }
    let config = document::typed(&tree, &changes)?;
    ranges::check(&tree)?;
    Ok(Loaded { config, tree })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::{BaseLayer, ConfigError, Loaded, Origin, Preset, Sources, load};

    fn with(sets: &[&str]) -> Result<Loaded, ConfigError> {
        load(&Sources {
            sets: sets.iter().map(|text| (*text).to_owned()).collect(),
            ..Sources::default()
        })
    }

    fn project(text: &str) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("mocban.toml");
        std::fs::write(&file, text).expect("a small file");
        (dir, file)
    }

    #[test]
    fn a_pointer_of_git_lfs_in_place_of_settings_is_named() {
        let (_dir, file) =
            project("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n");
        let error = load(&Sources {
            base: BaseLayer::File(file),
            ..Sources::default()
        });
        let error = error.expect_err("no settings").to_string();
        let reason = "mocban.toml: the file is a pointer of Git LFS and does not hold the settings; fetch the settings with";
        assert!(error.contains(reason), "{error}");
    }

    #[test]
    fn flag_overrides_environment_which_overrides_the_file() {
        let (_dir, file) = project("[run]\nworkers = 2\nstage_timeout_s = 7");
        let sources = Sources {
            base: BaseLayer::Project(file.clone()),
            env: vec![
                ("MOCBAN_RUN__WORKERS".into(), "3".into()),
                ("MOCBAN_RUN__STAGE_TIMEOUT_S".into(), "8".into()),
            ],
            sets: vec!["run.workers=4".into()],
        };
        let loaded = load(&sources).expect("valid settings");
        assert_eq!(loaded.config.run.workers, 4);
        assert_eq!(loaded.config.run.stage_timeout_s, 8);
        assert_eq!(loaded.tree.origin("run.workers"), Origin::Flag);
        assert_eq!(
            loaded.tree.origin("run.stage_timeout_s"),
            Origin::Env("MOCBAN_RUN__STAGE_TIMEOUT_S".into())
        );
    }

    #[test]
    fn project_file_may_start_from_a_preset() {
        let (_dir, file) = project("preset = \"paper\"\n[run]\nworkers = 2");
        let loaded = load(&Sources {
            base: BaseLayer::Project(file.clone()),
            ..Sources::default()
        })
        .expect("valid settings");
        let paper = load(&Sources {
            base: BaseLayer::Preset(Preset::Paper),
            ..Sources::default()
        })
        .expect("valid preset");
        assert_eq!(loaded.config.stages, paper.config.stages);
        assert_eq!(loaded.tree.origin("run.workers"), Origin::File(file));
    }

    #[cfg(unix)]
    #[test]
    fn link_to_missing_settings_is_an_error() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let file = dir.path().join("mocban.toml");
        std::os::unix::fs::symlink("missing.toml", &file).expect("a link");
        let linked = load(&Sources {
            base: BaseLayer::Project(file),
            ..Sources::default()
        });
        assert!(
            matches!(linked, Err(ConfigError::Read { .. })),
            "{linked:?}"
        );
    }

    #[test]
    fn project_without_a_file_has_the_defaults() {
        let missing = BaseLayer::Project(PathBuf::from("/nonexistent/mocban.toml"));
        let loaded = load(&Sources {
            base: missing,
            ..Sources::default()
        })
        .expect("no file is no error");
        assert_eq!(loaded.config, with(&[]).expect("defaults").config);
    }

    #[test]
    fn file_named_by_config_must_exist() {
        let error = load(&Sources {
            base: BaseLayer::File("/nonexistent/x.toml".into()),
            ..Sources::default()
        })
        .expect_err("not there");
        assert!(error.to_string().contains("/nonexistent/x.toml"), "{error}");
    }

    #[test]
    fn wrong_type_names_layer_and_key() {
        let error = with(&["run.workers=many"]).expect_err("not a number");
        let text = error.to_string();
        assert_eq!(
            text,
            "--set: run.workers = \"many\" is not a whole number from 0"
        );
        let (_dir, file) = project("[run]\nworkers = -1");
        let error = load(&Sources {
            base: BaseLayer::Project(file.clone()),
            ..Sources::default()
        })
        .expect_err("negative");
        let wanted = format!("{}: run.workers = -1 ", file.display());
        assert!(error.to_string().starts_with(&wanted), "{error}");
    }

    #[test]
    fn number_outside_its_range_is_refused() {
        let error = with(&["run.workers=100000"]).expect_err("too many");
        assert_eq!(
            error.to_string(),
            "--set: run.workers = 100000 is outside the range 0 to 1024"
        );
    }

    #[test]
    fn bad_toml_names_file_and_line() {
        let (_dir, file) = project("[run]\nworkers 2\n");
        let error = load(&Sources {
            base: BaseLayer::Project(file.clone()),
            ..Sources::default()
        })
        .expect_err("no equals sign");
        let wanted = format!("{}: line 2: ", file.display());
        assert!(error.to_string().starts_with(&wanted), "{error}");
    }

    #[test]
    fn unknown_preset_environment_and_flag_are_refused() {
        let (_dir, file) = project("preset = \"papr\"");
        let error = load(&Sources {
            base: BaseLayer::Project(file),
            ..Sources::default()
        })
        .expect_err("no such preset");
        assert!(
            error.to_string().ends_with("did you mean \"paper\"?"),
            "{error}"
        );
        let error = load(&Sources {
            env: vec![("MOCBAN_RUNS__WORKERS".into(), "1".into())],
            ..Sources::default()
        })
        .expect_err("no such section");
        assert_eq!(
            error.to_string(),
            "MOCBAN_RUNS__WORKERS: there is no setting runs; did you mean \"run\"?"
        );
        let error = with(&["workers=1"]).expect_err("no section");
        assert!(matches!(error, ConfigError::SetForm(_)), "{error}");
    }

    /// Text from outside is shown without control characters, and shortened.
    #[test]
    fn quoted_text_is_sanitized_and_short() {
        for rude in ["a\u{1b}[2J".to_owned(), "a".repeat(200)] {
            let (_dir, file) = project(&format!("preset = {}", toml::Value::from(rude.clone())));
            let file = load(&Sources {
                base: BaseLayer::Project(file),
                ..Sources::default()
            });
            let env = load(&Sources {
                env: vec![(format!("MOCBAN_RUN__{}", rude.to_uppercase()), "1".into())],
                ..Sources::default()
            });
            let errors = [
                file,
                env,
                with(&[&rude]),
                with(&[&format!("run.{rude}=1")]),
                with(&[&format!("run.workers={rude}")]),
                with(&[&format!("{rude}.workers=1")]),
            ];
            for error in errors.map(|result| result.expect_err("refused").to_string()) {
                let is_whole = error.to_lowercase().contains(&rude.to_lowercase());
                assert!(!is_whole, "{error:?}");
            }
        }
    }

    #[test]
    fn variables_with_one_underscore_are_read_and_mistyped_ones_refused() {
        let env = |name: &str, value: &str| {
            load(&Sources {
                env: vec![
                    (name.to_owned(), value.to_owned()),
                    ("MOCBAN_BREAK_AT".into(), "fit".into()),
                ],
                ..Sources::default()
            })
        };
        let loaded = env("MOCBAN_LIMITS_MESH_MAX_BYTES", "7").expect("a setting");
        assert_eq!(loaded.config.limits.mesh.max_bytes, 7);
        let error = env("MOCBAN_RUN_WROKERS", "7").expect_err("no setting");
        assert_eq!(
            error.to_string(),
            "MOCBAN_RUN_WROKERS: there is no setting run.wrokers; did you mean \"workers\"?"
        );
        let both = load(&Sources {
            env: vec![
                ("MOCBAN_RUN__WORKERS".into(), "2".into()),
                ("MOCBAN_RUN_WORKERS".into(), "3".into()),
            ],
            ..Sources::default()
        });
        assert_eq!(both.expect("settings").config.run.workers, 2);
    }

    #[test]
    fn value_of_two_lines_is_one_value() {
        let error = with(&["run.workers=2\nstage_timeout_s = 3"]).expect_err("two lines");
        assert_eq!(error.to_string().lines().count(), 1, "{error}");
    }

    #[test]
    fn value_that_is_not_toml_is_taken_as_text() {
        let error = with(&["run.workers=a b"]).expect_err("not a number");
        assert!(error.to_string().contains("\"a b\""), "{error}");
    }
}

//! A project folder with the settings that say where its catalog and its files are.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::error::ProjectResult;
use crate::exit::Refusal;
use crate::input_paths::in_existing_form;
use mocban_catalog::Catalog;
use mocban_config::{BaseLayer, ConfigError, Loaded, Sources, load};
use mocban_core::domain::{UnixMillis, has_password};
use mocban_store::{CATALOG_FILE, Project, ProjectStorage, SETTINGS_FILE, StorageOptions};

/// A project folder, which need not exist, and the layers of its settings.
#[derive(Debug, Clone)]
pub struct Location {
    /// The folder.
    pub dir: PathBuf,
    /// Address of the catalog instead of that in the settings: empty for the file in the folder.
    pub catalog: Option<String>,
    /// Name of a preset or path of a file, instead of the settings file in the folder.
    pub config: Option<String>,
    /// Single settings, as `section.key=value`.
    pub sets: Vec<String>,
    /// The settings, once they were loaded without an error.
    settings: OnceLock<Loaded>,
}

impl Location {
    /// Names a project folder, with the settings in it and those of the environment. A folder whose name has the other
    /// Unicode form of accented letters is the same folder.
    pub fn new(dir: impl Into<PathBuf>) -> Self {
        Self {
            dir: in_existing_form(&dir.into()),
            catalog: None,
            config: None,
            sets: Vec::new(),
            settings: OnceLock::new(),
        }
    }

    /// Returns the same settings for another folder.
    #[must_use]
    pub fn at(&self, dir: &Path) -> Self {
        Self {
            dir: in_existing_form(dir),
            settings: OnceLock::new(),
            ..self.clone()
        }
    }

    /// Returns a copy without `config` and `sets`, for use after their settings were saved in the project's file.
    #[must_use]
    pub fn with_saved_settings(&self) -> Self {
        Self {
            catalog: self.catalog.clone(),
            ..Self::new(&self.dir)
        }
    }

    /// Opens the project and its catalog for reading; works during a run.
    pub async fn open_read_only(&self) -> ProjectResult<(Project, Catalog)> {
        let (project, url) = self.project()?;
        let catalog = match url {
            Some(url) => Catalog::connect_read_only(&url).await?,
            None => Catalog::open_read_only(&project.catalog_path()).await?,
        };
        Ok((project, catalog))
    }

    /// Opens the project and its catalog for reading and writing.
    pub async fn open(&self) -> ProjectResult<(Project, Catalog)> {
        let (project, url) = self.project()?;
        let catalog = match url {
            Some(url) => Catalog::connect(&url).await?,
            None => Catalog::open(&project.catalog_path()).await?,
        };
        Ok((project, catalog))
    }

    /// Returns the project, and the URL of its catalog if that is in PostgreSQL.
    fn project(&self) -> ProjectResult<(Project, Option<String>)> {
        let (storage, url) = self.data_locations()?;
        let project = match url {
            Some(_) => Project::open_directory(&self.dir)?,
            None => Project::open(&self.dir)?,
        };
        Ok((project.with_storage(storage), url))
    }

    /// Returns the named roots with the object store, and the URL of the catalog if that is in PostgreSQL.
    pub fn data_locations(&self) -> ProjectResult<(Option<ProjectStorage>, Option<String>)> {
        let settings = match self.settings() {
            Err(error) if self.may_name_places(&error) => return Err(error.into()),
            settings => settings,
        };
        let storage = Self::storage(settings.as_ref().ok())?;
        Ok((storage, self.catalog_of(settings)?))
    }

    /// Returns the named roots and the object store of the settings. Sends no request. Returns `None` if the settings
    /// name none, or are invalid.
    fn storage(settings: Option<&Loaded>) -> ProjectResult<Option<ProjectStorage>> {
        let Some(settings) = settings.map(|settings| &settings.config.storage) else {
            return Ok(None);
        };
        let options = StorageOptions {
            artifacts: settings.artifacts.clone(),
            roots: settings.roots.clone(),
            cache: settings.cache.clone(),
            cache_bytes: settings.cache_gb.saturating_mul(1_000_000_000),
        };
        Ok(ProjectStorage::open(&options)?)
    }

    /// Returns the URL of the catalog in PostgreSQL, or `None` if the catalog is a file in the project.
    ///
    /// # Errors
    /// Returns an error if the URL on the command line has a password, or if the settings are invalid and may name a
    /// catalog elsewhere, or no catalog file shows where the catalog is.
    pub fn catalog_url(&self) -> ProjectResult<Option<String>> {
        self.catalog_of(self.settings())
    }

    fn catalog_of(&self, settings: Result<Loaded, ConfigError>) -> ProjectResult<Option<String>> {
        if let Some(url) = &self.catalog {
            refuse_password(url)?;
            return Ok(Some(url.clone()).filter(|url| !url.is_empty()));
        }
        match settings {
            Ok(settings) => {
                let url = settings.config.storage.catalog;
                Ok(Some(url).filter(|url| !url.is_empty()))
            }
            // Commands that need no settings work with invalid ones, but not with a file that cannot be read.
            Err(error) if self.dir.join(CATALOG_FILE).exists() && !self.may_name_places(&error) => {
                Ok(None)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Returns the settings in effect for this project. The file is read once, so that all parts of a command have the
    /// same settings.
    pub fn settings(&self) -> Result<Loaded, ConfigError> {
        if let Some(settings) = self.settings.get() {
            return Ok(settings.clone());
        }
        let settings = load(&self.sources())?;
        Ok(self.settings.get_or_init(|| settings).clone())
    }

    fn sources(&self) -> Sources {
        let base = match &self.config {
            Some(name) => name
                .parse()
                .map_or_else(|_: String| BaseLayer::File(name.into()), BaseLayer::Preset),
            None => BaseLayer::Project(self.dir.join(SETTINGS_FILE)),
        };
        let env = std::env::vars_os()
            .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)))
            .collect();
        let sets = self.sets.clone();
        Sources { base, env, sets }
    }

    /// Refuses settings of the environment, of flags or of a file in the directory that lead commands on a new project to a
    /// catalog on a server or to an object store, instead of its folder.
    pub fn require_local(&self, project: &str) -> ProjectResult<()> {
        let settings = self.settings()?;
        let storage = &settings.config.storage;
        let catalog = self.catalog_url()?.unwrap_or_default();
        for (key, place, instead) in [
            ("storage.catalog", &catalog, "--catalog ''"),
            (
                "storage.artifacts",
                &storage.artifacts,
                "--set storage.artifacts=",
            ),
        ] {
            if place.is_empty() {
                continue;
            }
            let origin = if key == "storage.catalog" && self.catalog.is_some() {
                "--catalog".to_owned()
            } else {
                settings.tree.origin(key).to_string()
            };
            return Err(Refusal::Usage(format!(
                "{origin} sets {key} to {place}, so commands on {project} would work there and not in its folder; remove that setting, or give {instead} to this command and all others on the project"
            ))
            .into());
        }
        Ok(())
    }

    /// Returns whether invalid settings may name a catalog or artifacts elsewhere. Then a command must not use the files in
    /// the project's folder instead.
    fn may_name_places(&self, error: &ConfigError) -> bool {
        matches!(error, ConfigError::Read { .. }) || self.sources().may_set("storage")
    }
}

/// Returns the settings of the file in a project folder, without those of the environment and of flags.
pub(crate) fn settings_of(dir: &Path) -> Result<Loaded, ConfigError> {
    load(&Sources {
        base: BaseLayer::Project(dir.join(SETTINGS_FILE)),
        ..Sources::default()
    })
}

/// Refuses an address of PostgreSQL with a password, which other users of the machine could read.
pub(crate) fn refuse_password(url: &str) -> Result<(), Refusal> {
    if has_password(url) {
        let text = "other users of this machine can read a password on the command line; put it into ~/.pgpass or PGPASSWORD";
        return Err(Refusal::Usage(text.to_owned()));
    }
    Ok(())
}

/// Returns the current time; no other clock reaches the catalog.
pub fn now() -> UnixMillis {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_millis() as UnixMillis)
}

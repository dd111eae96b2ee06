//! A project on disk: the directory, its inputs and its artifacts.

use std::path::{Path, PathBuf};

use crate::domain::ArtifactRef;

/// Name of the catalog file in a project.
pub const CATALOG_FILE: &str = "catalog.sqlite";
/// Name of the settings file in a project.
pub const SETTINGS_FILE: &str = "mocban.toml";

/// A project directory.
#[derive(Debug, Clone)]
pub struct Project {
    dir: PathBuf,
}

/// What can go wrong with a project's files.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The directory holds no catalog.
    #[error("no project at {0}: it has no catalog.sqlite")]
    NoProject(PathBuf),
    /// A file operation failed.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl Project {
    /// A project that is there.
    ///
    /// # Errors
    /// When the directory holds no catalog.
    pub fn open(dir: &Path) -> Result<Self, StoreError> {
        if !dir.join(CATALOG_FILE).is_file() {
            return Err(StoreError::NoProject(dir.to_owned()));
        }
        Ok(Self {
            dir: dir.to_owned(),
        })
    }

    /// Makes the directory and its rooms where they are missing.
    ///
    /// # Errors
    /// When they cannot be made.
    pub fn create(dir: &Path) -> Result<Self, StoreError> {
        let _ = dir;
        todo!()
    }

    /// The directory.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Path of the catalog.
    pub fn catalog_path(&self) -> PathBuf {
        self.dir.join(CATALOG_FILE)
    }

    /// Path of the settings file, which may not be there.
    pub fn settings_path(&self) -> PathBuf {
        self.dir.join(SETTINGS_FILE)
    }

    /// Where an input lies: stored paths are relative to the project, or absolute.
    pub fn input_path(&self, stored: &str) -> PathBuf {
        self.dir.join(stored)
    }

    /// How a path is stored: relative to the project when it lies below it, otherwise absolute.
    ///
    /// # Errors
    /// When the working directory cannot be told.
    pub fn stored_path(&self, path: &Path) -> Result<String, StoreError> {
        let _ = path;
        todo!()
    }

    /// Where an artifact lies.
    pub fn artifact_path(&self, artifact: &ArtifactRef) -> PathBuf {
        let hex = artifact.hash.to_hex();
        self.dir
            .join("artifacts")
            .join(&hex[..2])
            .join(format!("{hex}.{}", artifact.ext))
    }

    /// The bytes of an artifact, checked against its hash.
    ///
    /// # Errors
    /// When the file is missing, unreadable or not what it was.
    pub fn read_artifact(&self, artifact: &ArtifactRef) -> Result<Vec<u8>, StoreError> {
        let _ = artifact;
        todo!()
    }
}

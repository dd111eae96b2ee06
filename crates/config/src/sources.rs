//! The layers above the defaults: preset, file, environment variables, flags.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::error::{ConfigError, Origin, quote};
use super::tree::Tree;
use mocban_core::domain::spelling::hint;
use mocban_core::domain::{FileKind, enum_names, pointer_of};
use mocban_store::read_file_or_pipe;
use mocban_system::platform::is_pipe;

/// Settings that come with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    /// The best known method; contains every setting.
    #[default]
    Default,
    /// The paper's method. Contains only the settings that differ from the default.
    Paper,
}

enum_names! { pub Preset, "a preset":
    Default = "default", Paper = "paper",
}

impl Preset {
    /// Returns the TOML text, with a comment for each setting.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Default => include_str!("../../../config/default.toml"),
            Self::Paper => include_str!("../../../config/paper.toml"),
        }
    }

    pub(super) fn table(self) -> Result<Table, ConfigError> {
        parse(self.text(), &self.origin())
    }

    const fn origin(self) -> Origin {
        match self {
            Self::Default => Origin::Default,
            Self::Paper => Origin::Preset("paper"),
        }
    }
}

/// Returns the lines of the comment on a setting in `config/default.toml`, without the comment signs. A comment applies
/// to all settings below it, up to the next comment or section. A comment above a section's header is not returned.
pub fn explanation(key: &str) -> Vec<&'static str> {
    let Some((section, name)) = key.rsplit_once('.') else {
        return Vec::new();
    };
    let (mut current, mut comment, mut is_complete) = ("", Vec::new(), true);
    for line in Preset::Default.text().lines() {
        if let Some(text) = line.strip_prefix("# ") {
            if is_complete {
                comment.clear();
            }
            comment.push(text);
            is_complete = false;
        } else if let Some(header) = line.strip_prefix('[') {
            current = header.trim_end_matches(']');
            comment.clear();
        } else {
            let is_key = line.split_once(" = ").is_some_and(|(key, _)| key == name);
            if is_key && current == section {
                return comment;
            }
            is_complete = true;
        }
    }
    Vec::new()
}

/// The layers between the defaults and the environment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BaseLayer {
    /// A preset alone (`--config paper`).
    Preset(Preset),
    /// A file that must exist (`--config FILE`), instead of the project's.
    File(PathBuf),
    /// The project's file, which need not exist.
    Project(PathBuf),
}

impl Default for BaseLayer {
    fn default() -> Self {
        Self::Preset(Preset::Default)
    }
}

/// Everything that settings are read from, except the embedded defaults.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// Preset or file.
    pub base: BaseLayer,
    /// Environment variables. A variable named `MOCBAN_SECTION__KEY` or `MOCBAN_SECTION_KEY` sets a setting. Variables
    /// with other names are ignored.
    pub env: Vec<(String, String)>,
    /// `section.key=value`, as given to `--set`.
    pub sets: Vec<String>,
}

impl Sources {
    /// Returns the layers that are tables, lowest first.
    pub(super) fn tables(&self) -> Result<Vec<(Table, Origin)>, ConfigError> {
        match &self.base {
            BaseLayer::Preset(preset) => preset_layer(*preset),
            BaseLayer::File(path) => file_layers(path),
            BaseLayer::Project(path) => match is_present(path) {
                Ok(true) => file_layers(path),
                Ok(false) => Ok(Vec::new()),
                Err(source) => Err(ConfigError::Read {
                    path: path.clone(),
                    source,
                }),
            },
        }
    }

    /// Returns whether a layer may set a key of a section, although the settings may be invalid: whether the project's file
    /// contains the name, or a variable or flag begins with it. Any other file may.
    pub fn may_set(&self, section: &str) -> bool {
        let in_file = match &self.base {
            BaseLayer::Preset(_) => false,
            // A pipe cannot be read twice.
            BaseLayer::File(_) => true,
            BaseLayer::Project(path) => {
                let bytes = read_file_or_pipe(path, MAX_FILE_BYTES).unwrap_or_default();
                // A key may be written with escapes.
                let text = String::from_utf8_lossy(&bytes);
                text.lines()
                    .any(|line| !line.trim_start().starts_with('#') && line.contains(section))
                    || text.contains("\\u")
                    || text.contains("\\x")
            }
        };
        let prefix = format!("MOCBAN_{}_", section.to_ascii_uppercase());
        in_file
            || self.env.iter().any(|(name, _)| name.starts_with(&prefix))
            || self
                .sets
                .iter()
                .any(|set| set.trim_start().starts_with(section))
    }

    /// Returns the settings from environment variables, followed by the settings from flags.
    pub(super) fn single_values(
        &self,
        defaults: &Tree,
    ) -> Result<Vec<(String, Value, Origin)>, ConfigError> {
        let mut named: Vec<_> = self
            .env
            .iter()
            .filter_map(|(name, text)| Some((env_key(name, defaults)?, name, text)))
            .collect();
        // If both spellings of a name are set, the one with two underscores is sorted last and overrides the other.
        named.sort();
        let mut values: Vec<_> = named
            .into_iter()
            .map(|(key, name, text)| (key, value(text), Origin::Env(name.clone())))
            .collect();
        for text in &self.sets {
            let (key, new) = split_set(text)?;
            values.push((key, new, Origin::Flag));
        }
        Ok(values)
    }
}

/// Returns the key of the setting that an environment variable sets. Both `MOCBAN_LIMITS__MESH__MAX_BYTES` and
/// `MOCBAN_LIMITS_MESH_MAX_BYTES` set `limits.mesh.max_bytes`. Unknown keys are returned too and reported later.
/// Returns `None` if the name does not start with `MOCBAN_`, or if neither `__` nor a section's name follows this
/// prefix.
fn env_key(name: &str, defaults: &Tree) -> Option<String> {
    let rest = name.strip_prefix("MOCBAN_")?.to_ascii_lowercase();
    if rest.contains("__") {
        return Some(rest.replace("__", "."));
    }
    let (section, key) = rest.split_once('_')?;
    defaults.table().get(section)?;
    let mut known = defaults.settings().into_iter().map(|setting| setting.key);
    let same = known.find(|known| known.replace('.', "_") == rest);
    Some(same.unwrap_or_else(|| format!("{section}.{key}")))
}

fn split_set(text: &str) -> Result<(String, Value), ConfigError> {
    let parts = |key: &str| key.split('.').filter(|part| !part.is_empty()).count();
    match text.split_once('=') {
        Some((key, new)) if parts(key.trim()) > 1 => Ok((key.trim().to_owned(), value(new.trim()))),
        Some(_) | None => Err(ConfigError::SetForm(text.to_owned())),
    }
}

/// Parses a TOML value. Text that is not valid TOML becomes a string, so strings need no quotes.
fn value(text: &str) -> Value {
    format!("value = {text}")
        .parse::<Table>()
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

fn preset_layer(preset: Preset) -> Result<Vec<(Table, Origin)>, ConfigError> {
    match preset {
        Preset::Default => Ok(Vec::new()),
        Preset::Paper => Ok(vec![(preset.table()?, preset.origin())]),
    }
}

/// Returns whether a project has a file of settings.
///
/// # Errors
/// Returns an error if the file is a link to a missing file, if it is a pipe, or if the system does not say whether it
/// exists. The defaults would make results stale, and opening a pipe would wait for a writer.
fn is_present(path: &Path) -> std::io::Result<bool> {
    match path.symlink_metadata() {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Ok(false);
        }
        found => found?,
    };
    if is_pipe(path.metadata()?.file_type()) {
        return Err(std::io::Error::other("it is a pipe, not a file"));
    }
    Ok(true)
}

/// Longest file of settings that is read, in bytes.
const MAX_FILE_BYTES: u64 = 1 << 20;

fn file_layers(path: &Path) -> Result<Vec<(Table, Origin)>, ConfigError> {
    let failed = |source| ConfigError::Read {
        path: path.to_owned(),
        source,
    };
    let bytes = read_file_or_pipe(path, MAX_FILE_BYTES).map_err(failed)?;
    let text = String::from_utf8(bytes)
        .map_err(|error| failed(std::io::Error::new(ErrorKind::InvalidData, error)))?;
    let origin = Origin::File(path.to_owned());
    let mut table = parse(&text, &origin)?;
    let mut layers = match table.remove("preset") {
        Some(name) => preset_layer(find_preset(&name, &origin)?)?,
        None => Vec::new(),
    };
    layers.push((table, origin));
    Ok(layers)
}

fn find_preset(name: &Value, origin: &Origin) -> Result<Preset, ConfigError> {
    let name = name
        .as_str()
        .map_or_else(|| name.to_string(), ToOwned::to_owned);
    let mut presets = Preset::ALL.into_iter();
    presets.find(|preset| preset.name() == name).ok_or_else(|| {
        let hint = hint(&name, Preset::ALL.map(Preset::name));
        let name = quote(&name);
        ConfigError::Layer {
            origin: origin.clone(),
            problem: format!("there is no preset \"{name}\", only default and paper{hint}"),
        }
    })
}

pub(super) fn parse(text: &str, origin: &Origin) -> Result<Table, ConfigError> {
    text.parse::<Table>().map_err(|error| {
        if FileKind::of(text.as_bytes()) == FileKind::LfsPointer {
            return ConfigError::Layer {
                origin: origin.clone(),
                problem: format!("the file {}", pointer_of("settings")),
            };
        }
        let before = error
            .span()
            .map_or(0, |span| text.floor_char_boundary(span.start));
        let line = 1 + text[..before].matches('\n').count();
        ConfigError::Layer {
            origin: origin.clone(),
            problem: format!("line {line}: {}", quote(error.message())),
        }
    })
}

//! BLAKE3 hashes that identify contents: input files, artifacts, fingerprints, results.

use std::io::{self, Read};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::cancel::PolledReader;

/// A 256-bit BLAKE3 hash; 64 lower-case hexadecimal digits in text.
///
/// ```
/// use mocban_core::domain::ContentHash;
///
/// let hash = ContentHash::of(b"mocban");
/// assert_eq!(hash.to_hex().parse(), Ok(hash));
/// assert!(hash.to_hex().starts_with(&hash.short()));
/// assert_eq!(ContentHash::of_source(&b"mocban"[..])?, hash);
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
pub struct ContentHash([u8; 32]);

/// The text is not 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a hash of 64 hexadecimal digits")]
pub struct ContentHashError(String);

impl ContentHash {
    /// Computes the hash of the bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Computes the hash of all bytes of a source, which is read a part at a time.
    ///
    /// # Errors
    /// Returns an error if the source cannot be read.
    pub fn of_source(source: impl Read) -> io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(PolledReader(source))?;
        Ok(Self(*hasher.finalize().as_bytes()))
    }

    /// Wraps the 32 bytes of a hash, as the catalog stores them.
    pub const fn from_bytes(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// Returns the 32 bytes.
    pub const fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }

    /// Returns 64 hexadecimal digits.
    pub fn to_hex(self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }

    /// Returns the first 12 digits, for messages.
    pub fn short(self) -> String {
        self.to_hex()[..12].to_owned()
    }
}

impl std::str::FromStr for ContentHash {
    type Err = ContentHashError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match blake3::Hash::from_hex(text) {
            Ok(hash) => Ok(Self(*hash.as_bytes())),
            Err(_) => Err(ContentHashError(text.to_owned())),
        }
    }
}

impl TryFrom<String> for ContentHash {
    type Error = ContentHashError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<ContentHash> for String {
    fn from(hash: ContentHash) -> Self {
        hash.to_hex()
    }
}

impl std::fmt::Display for ContentHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.to_hex())
    }
}

impl std::fmt::Debug for ContentHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ContentHash({})", self.short())
    }
}

//! The C libraries of `tests/faults`. They are compiled once and preloaded into the binary.

use std::path::PathBuf;
use std::process::Command;
use std::sync::LazyLock;

/// Makes chosen system calls fail.
pub(crate) static FAULTS: LazyLock<Shim> = LazyLock::new(|| Shim::built("faults"));

/// Records the state of the disk after each sync.
pub(crate) static SHADOW: LazyLock<Shim> = LazyLock::new(|| Shim::built("shadow"));

/// A compiled library in a temporary folder.
pub(crate) struct Shim {
    library: PathBuf,
    _dir: tempfile::TempDir,
}

impl Shim {
    fn built(name: &str) -> Self {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let library = dir.path().join(format!("{name}.so"));
        let source = format!("{}/tests/faults/{name}.c", env!("CARGO_MANIFEST_DIR"));
        let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
        let built = Command::new(&compiler)
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&library)
            .arg(&source)
            .args(["-ldl", "-lpthread"])
            .output();
        let shown = compiler.display();
        let built = built.map_err(|error| {
            format!("{shown}: {error}; a C compiler is needed, as for the bundled SQLite")
        });
        let built = built.expect("a C compiler");
        let stderr = String::from_utf8_lossy(&built.stderr);
        assert!(built.status.success(), "{source}: {stderr}");
        Self { library, _dir: dir }
    }

    /// Preloads the library into a command.
    pub(crate) fn load<'c>(&self, command: &'c mut Command) -> &'c mut Command {
        command.env("LD_PRELOAD", &self.library)
    }
}

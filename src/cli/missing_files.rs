//! Files of a list that do not exist.

use super::exit::Refusal;

/// Maximum number of missing files that `--json` lists.
const MAX_MISSING: usize = 1000;

/// Files of a list that do not exist.
#[derive(Debug, Default)]
pub(super) struct MissingFiles {
    /// Messages of the first [`MAX_MISSING`] files.
    pub(super) lines: Vec<String>,
    /// Number of all missing files.
    pub(super) count: usize,
}

impl MissingFiles {
    /// Adds the message of a file.
    pub(super) fn add(&mut self, line: String) {
        self.count += 1;
        if self.lines.len() < MAX_MISSING {
            self.lines.push(line);
        }
    }

    /// Returns why a list with missing files is refused.
    pub(super) fn refusal(&self) -> Refusal {
        const MAX_SHOWN: usize = 10;
        let shown = &self.lines[..self.lines.len().min(MAX_SHOWN)];
        let more = match self.count - shown.len() {
            0 => String::new(),
            more => format!("\n  and {more} more"),
        };
        Refusal::Usage(format!(
            "{} missing, nothing was imported:\n  {}{more}\ncorrect the paths, or use --allow-missing if the files are added \
             before the run",
            match self.count {
                1 => "1 file is".to_owned(),
                files => format!("{files} files are"),
            },
            shown.join("\n  "),
        ))
    }
}

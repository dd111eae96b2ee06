//! Rows of an import between two passes: the first looks at the files on disk, the second writes to the catalog and holds its
//! write lock.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, BufWriter, Seek as _, SeekFrom, Write as _};

use tokio::sync::mpsc;

use mocban_catalog::{ImportChunk, ImportRow};

/// Maximum number of rows of a chunk that is sent to the catalog.
const CHUNK_ROWS: usize = 2_000;
/// A chunk ends with the row that reaches this many bytes of JSON. Numbers of one digit need 16 times as much memory.
const CHUNK_BYTES: usize = 1 << 18;

/// Rows in an unnamed temporary file, one JSON object per line. A list may have millions of rows.
#[derive(Debug)]
pub(crate) struct RowSpool(BufWriter<File>);

impl RowSpool {
    /// Creates the file in the system's folder of temporary files.
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self(BufWriter::new(tempfile::tempfile()?)))
    }

    /// Appends a row.
    pub(crate) fn push(&mut self, row: &ImportRow) -> io::Result<()> {
        serde_json::to_writer(&mut self.0, row)?;
        self.0.write_all(b"\n")
    }

    /// Sends all rows in chunks, then the end. After an error, the end is not sent, and the catalog imports nothing. Stops if
    /// nobody receives: the catalog reports its error itself.
    pub(crate) fn send(&mut self, chunks: &mpsc::Sender<ImportChunk>) -> io::Result<()> {
        // Flushes, too.
        self.0.seek(SeekFrom::Start(0))?;
        let mut reader = BufReader::new(self.0.get_ref());
        let (mut line, mut rows, mut bytes) = (String::new(), Vec::new(), 0);
        while reader.read_line(&mut line)? > 0 {
            rows.push(serde_json::from_str(&line)?);
            bytes += line.len();
            line.clear();
            if rows.len() == CHUNK_ROWS || bytes >= CHUNK_BYTES {
                let chunk = ImportChunk::Rows(std::mem::take(&mut rows));
                if chunks.blocking_send(chunk).is_err() {
                    return Ok(());
                }
                bytes = 0;
            }
        }
        for last in [ImportChunk::Rows(rows), ImportChunk::End] {
            let _ = chunks.blocking_send(last);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{CHUNK_ROWS, RowSpool};
    use mocban_catalog::{ImportChunk, ImportRow};
    use serde_json::json;
    use tokio::sync::mpsc;

    #[test]
    fn every_row_comes_back_as_it_was_each_time() {
        let row = |k: usize| ImportRow {
            name: format!("chữ số {k}").parse().expect("a name"),
            mesh_path: format!("quét/{k}\n.stl"),
            print_path: "\u{1f}\"\\".to_owned(),
            unit: None,
            scanned_face_down: Some(true),
            character: Some("\u{f0123}".to_owned()),
            block: None,
            meta: [("x".to_owned(), json!([0.1, null, {"": -0.0}]))]
                .into_iter()
                .collect(),
            prior: None,
        };
        let rows: Vec<ImportRow> = (0..CHUNK_ROWS + 7).map(row).collect();
        let mut spool = RowSpool::new().expect("a temporary file");
        for row in &rows {
            spool.push(row).expect("written");
        }
        for _ in 0..2 {
            let (sender, mut received) = mpsc::channel(8);
            spool.send(&sender).expect("read");
            drop(sender);
            let mut found = Vec::new();
            let mut ends = 0;
            while let Some(chunk) = received.blocking_recv() {
                match chunk {
                    ImportChunk::Rows(rows) => found.extend(rows),
                    ImportChunk::End => ends += 1,
                }
            }
            assert!(found == rows && ends == 1);
        }
    }
}

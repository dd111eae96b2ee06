//! Opening files of users. Opening a pipe waits for a writer, and some devices never end, so the type is checked first.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

use super::input_error::{InputError, with_advice};
use mocban_system::platform::{is_pipe, is_socket, let_reads_wait, open_without_waiting};

/// Returns the metadata of a regular file.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, or may not be accessed.
pub(super) fn regular_metadata(path: &Path) -> Result<Metadata, InputError> {
    let meta = std::fs::metadata(path).map_err(|error| InputError::io(path, error))?;
    check_regular(path, &meta)?;
    Ok(meta)
}

/// Opens a regular file for reading. Never waits for a pipe, even if the file is replaced by a pipe at this moment.
///
/// # Errors
/// Returns an error if the file does not exist, is not a regular file, or cannot be opened.
pub fn open_regular(path: &Path) -> Result<(File, Metadata), InputError> {
    regular_metadata(path)?;
    let failed = |error: io::Error| InputError::io(path, error);
    let file = open_without_waiting(path).map_err(failed)?;
    let meta = file.metadata().map_err(failed)?;
    check_regular(path, &meta)?;
    // Some archive file systems fail instead of waiting if this flag is set.
    let_reads_wait(&file).map_err(failed)?;
    Ok((file, meta))
}

/// Reads a file that a user names on the command line or as settings, up to `limit` bytes. Also reads a pipe, such as
/// `/dev/stdin` or the `<(command)` of a shell.
///
/// # Errors
/// Returns an error if the file does not exist, is neither a regular file nor a pipe, cannot be read, or is longer than
/// `limit` bytes.
pub fn read_file_or_pipe(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let read = || {
        check_readable(&std::fs::metadata(path)?)?;
        // A pipe is opened as usual: this waits until its writer has opened it too.
        let file = File::open(path)?;
        check_readable(&file.metadata()?)?;
        read_up_to(file, limit)
    };
    read().map_err(with_advice)
}

/// Reads an input, such as the standard input, to its end.
///
/// # Errors
/// Returns an error if reading fails, or there are more than `limit` bytes.
pub fn read_up_to(input: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let text = format!("it has more than {limit} bytes, the most that is read of such a file");
        return Err(io::Error::other(text));
    }
    Ok(bytes)
}

fn check_regular(path: &Path, meta: &Metadata) -> Result<(), InputError> {
    if meta.is_file() {
        return Ok(());
    }
    Err(InputError::NotAFile {
        path: path.to_owned(),
        kind: file_kind(meta),
    })
}

fn check_readable(meta: &Metadata) -> io::Result<()> {
    if meta.is_file() || is_pipe(meta.file_type()) {
        return Ok(());
    }
    let text = format!("it is {}, not a file", file_kind(meta));
    Err(io::Error::other(text))
}

/// Returns what an entry of a folder is.
pub(super) fn file_kind(meta: &Metadata) -> &'static str {
    let file_type = meta.file_type();
    if file_type.is_file() {
        "a file"
    } else if file_type.is_dir() {
        "a directory"
    } else if is_pipe(file_type) {
        "a pipe"
    } else if is_socket(file_type) {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    #[cfg(unix)]
    use std::path::Path;

    #[cfg(unix)]
    use super::open_regular;
    use super::{read_file_or_pipe, read_up_to};

    #[cfg(unix)]
    fn pipe(path: &Path) {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_or_a_device_is_refused_as_an_input_without_waiting() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("print.png");
        pipe(&path);
        let refused = open_regular(&path).expect_err("a pipe").to_string();
        assert!(
            refused.ends_with("print.png is a pipe, not a file"),
            "{refused}"
        );
        let refused = open_regular(Path::new("/dev/zero")).expect_err("a device");
        assert_eq!(refused.to_string(), "/dev/zero is a device, not a file");
    }

    #[cfg(unix)]
    #[test]
    fn a_list_may_come_from_a_pipe_but_not_from_a_device() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("pairs.csv");
        pipe(&path);
        let writer = std::thread::spawn({
            let path = path.clone();
            move || std::fs::write(path, "id,mesh,print\n")
        });
        let read = read_file_or_pipe(&path, 100).expect("a pipe");
        assert_eq!(read, b"id,mesh,print\n");
        writer.join().expect("joined").expect("written");
        let refused = read_file_or_pipe(Path::new("/dev/zero"), 100).expect_err("a device");
        assert_eq!(refused.to_string(), "it is a device, not a file");
        let refused = read_file_or_pipe(dir.path(), 100).expect_err("a directory");
        assert_eq!(refused.to_string(), "it is a directory, not a file");
    }

    #[test]
    fn a_list_over_the_limit_is_refused() {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let path = dir.path().join("pairs.csv");
        std::fs::write(&path, "id,mesh,print\n").expect("written");
        assert!(read_up_to(&b"abc"[..], 3).is_ok());
        read_up_to(&b"abc"[..], 2).expect_err("too long");
        assert!(read_file_or_pipe(&path, 14).is_ok());
        let refused = read_file_or_pipe(&path, 13).expect_err("too long");
        assert!(
            refused.to_string().contains("more than 13 bytes"),
            "{refused}"
        );
    }
}

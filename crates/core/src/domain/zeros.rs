//! Files of zero bytes, as interrupted copies leave behind where space was reserved.

use std::io::{self, Read};

use super::cancel::poll;

/// Completes "the file", or follows its path.
pub const ONLY_ZEROS: &str = "has only zeros; was the copy interrupted? copy it again";
/// Bytes that are compared between two polls for a cancellation.
const BYTES_PER_POLL: usize = 1 << 16;

/// Returns whether bytes are all zero. Without bytes, they are not.
///
/// ```
/// use mocban_core::domain::are_zeros;
///
/// assert!(are_zeros(&[0; 9]));
/// assert!(!are_zeros(b"\0\0v 0 0 0"));
/// assert!(!are_zeros(b""));
/// ```
pub fn are_zeros(bytes: &[u8]) -> bool {
    let is_zero = |part: &[u8]| {
        poll();
        part.iter().all(|byte| *byte == 0)
    };
    !bytes.is_empty() && bytes.chunks(BYTES_PER_POLL).all(is_zero)
}

/// Returns whether all bytes that a source still has are zero.
///
/// # Errors
/// Returns an error if the source cannot be read.
pub fn has_only_zeros(source: &mut impl Read) -> io::Result<bool> {
    let mut bytes = vec![0; BYTES_PER_POLL];
    loop {
        poll();
        match source.read(&mut bytes) {
            Ok(0) => return Ok(true),
            Ok(read) if bytes[..read].iter().all(|byte| *byte == 0) => {}
            Ok(_) => return Ok(false),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{are_zeros, has_only_zeros};

    #[test]
    fn the_last_byte_decides() {
        let mut bytes = vec![0; 200_000];
        let in_source = |bytes: &[u8]| has_only_zeros(&mut &bytes[..]).expect("reads");
        assert!(are_zeros(&bytes) && in_source(&bytes));
        bytes[199_999] = 1;
        assert!(!are_zeros(&bytes) && !in_source(&bytes));
    }
}

//! The segments of a JPEG: frame, scans, tables and metadata.

use std::ops::Range;

use crate::domain::FileKind;
use crate::domain::cancel::{PollCounter, poll};
use crate::raster::decode::error::{DecodeError, broken};
use crate::raster::decode::orientation::StatedOrientation;

/// A colour component of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct JpegComponent {
    pub(super) id: u8,
    /// Samples side by side and one below the other, in the block in which the component with most has most.
    pub(super) sampling: [usize; 2],
    pub(super) quantization_table: u8,
}

/// The header of the image.
#[derive(Debug, Clone)]
pub(super) struct JpegFrame {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) is_progressive: bool,
    pub(super) components: Vec<JpegComponent>,
}

/// A scan: coefficients of one or more components.
#[derive(Debug, Clone)]
pub(super) struct JpegScan {
    /// Its header and its entropy-coded data.
    pub(super) range: Range<usize>,
    /// Positions of its components in the frame.
    pub(super) components: Vec<usize>,
    /// The coefficients that are complete after the scan, from the least significant bit.
    completes: u64,
}

/// What the segments of a file say about its image.
#[derive(Debug, Clone, Default)]
pub(in crate::raster::decode) struct JpegMetadata<'b> {
    /// The JFIF header behind its name.
    pub(in crate::raster::decode) jfif: Option<&'b [u8]>,
    /// The EXIF blocks.
    pub(in crate::raster::decode) exif: Vec<&'b [u8]>,
    pub(in crate::raster::decode) orientation: StatedOrientation,
}

/// What the segments of a file say.
#[derive(Debug, Clone, Default)]
pub(super) struct JpegSegments<'b> {
    pub(super) frame: Option<JpegFrame>,
    pub(super) scans: Vec<JpegScan>,
    /// Segments of tables, with their markers, in their order.
    pub(super) tables: Vec<Range<usize>>,
    pub(super) metadata: JpegMetadata<'b>,
    /// Numbers and bytes of the parts of the ICC profile.
    profile: Vec<(u8, &'b [u8])>,
    /// The colour transform that Adobe programs store.
    pub(super) adobe_transform: Option<u8>,
    /// Whether the segments lead to the end marker.
    pub(super) is_ended: bool,
}

const START_OF_SCAN: u8 = 0xda;
/// Most segments of tables, scans, EXIF and parts of a profile.
const MAX_SEGMENTS: usize = 10_000;

fn number(bytes: &[u8], at: usize) -> Option<usize> {
    let field = bytes.get(at..)?.first_chunk()?;
    Some(usize::from(u16::from_be_bytes(*field)))
}

impl<'b> JpegSegments<'b> {
    /// Reads the segments up to the end marker or the end of the bytes. Searching for the end marker is not enough,
    /// because a thumbnail has its own.
    ///
    /// # Errors
    /// Returns an error if the image is coded in a way that is not read.
    pub(super) fn read(bytes: &'b [u8]) -> Result<Self, DecodeError> {
        let mut found = Self::default();
        let mut counter = PollCounter::default();
        let mut at = 2;
        while let Some(&[first, second]) = bytes.get(at..).and_then(|rest| rest.first_chunk()) {
            counter.tick();
            match (first, second) {
                (0xff, 0xd9) => {
                    found.is_ended = true;
                    break;
                }
                (0xff, 0xff | 0x00 | 0x01 | 0xd0..=0xd8) => at += 1,
                (0xff, marker) => {
                    let Some(len) = number(bytes, at + 2) else {
                        break;
                    };
                    let end = (at + 2 + len).min(bytes.len());
                    found.close_scan(at);
                    found.add(marker, at..end, bytes)?;
                    at = end;
                }
                // Entropy-coded data: continue at the next byte that may begin a marker.
                _ => at = next_marker(bytes, at),
            }
        }
        found.close_scan(at.min(bytes.len()));
        Ok(found)
    }

    /// Ends the last scan at a marker.
    fn close_scan(&mut self, at: usize) {
        if let Some(scan) = self.scans.last_mut().filter(|scan| scan.range.end == 0) {
            scan.range.end = at;
        }
    }

    fn add(&mut self, marker: u8, range: Range<usize>, bytes: &'b [u8]) -> Result<(), DecodeError> {
        let kept = [
            self.tables.len(),
            self.scans.len(),
            self.profile.len(),
            self.metadata.exif.len(),
        ];
        if kept.iter().sum::<usize>() >= MAX_SEGMENTS {
            let reason = format!("it has more than {MAX_SEGMENTS} segments");
            return Err(broken(FileKind::Jpeg, &reason));
        }
        let body = bytes.get(range.start + 4..range.end).unwrap_or_default();
        match marker {
            0xc4 | 0xdb | 0xdd => self.tables.push(range),
            0xc0..=0xcf if marker != 0xc8 && marker != 0xcc && self.frame.is_none() => {
                self.frame = Some(frame(marker, body)?);
            }
            START_OF_SCAN => {
                let scan = self.frame.as_ref().and_then(|frame| {
                    let start = range.start;
                    scan(frame, body, start)
                });
                self.scans.extend(scan);
            }
            0xe0 if self.metadata.jfif.is_none() => {
                self.metadata.jfif = body.strip_prefix(b"JFIF\0");
            }
            0xe1 => {
                let exif = body.strip_prefix(b"Exif\0\0");
                self.metadata.exif.extend(exif);
                self.metadata.orientation.add_segment(body);
            }
            0xe2 => {
                let part = body.strip_prefix(b"ICC_PROFILE\0");
                if let Some(&[number, _, ref part @ ..]) = part {
                    self.profile.push((number, part));
                }
            }
            0xee if body.starts_with(b"Adobe") => self.adobe_transform = body.get(11).copied(),
            _ => {}
        }
        Ok(())
    }

    /// Returns the ICC profile, whose parts are numbered from 1. It is empty if one of the parts is missing.
    pub(super) fn profile(&self) -> Option<Vec<u8>> {
        let mut parts = self.profile.clone();
        parts.sort_by_key(|(number, _)| *number);
        let mut numbers = (1..).zip(&parts);
        let is_whole = numbers.all(|(wanted, (number, _))| wanted == usize::from(*number));
        let whole = parts.iter().filter(|_| is_whole);
        (!parts.is_empty()).then(|| whole.flat_map(|(_, part)| *part).copied().collect())
    }

    /// Returns whether the scans have all bits of all coefficients.
    pub(super) fn has_all_scans(&self) -> bool {
        let components = self
            .frame
            .as_ref()
            .map_or(0, |frame| frame.components.len());
        components > 0
            && (0..components).all(|component| {
                let scans = self.scans.iter();
                let scans = scans.filter(|scan| scan.components.contains(&component));
                scans.fold(0, |done, scan| done | scan.completes) == u64::MAX
            })
    }
}

/// Returns where the next marker may be.
fn next_marker(bytes: &[u8], from: usize) -> usize {
    const BYTES_PER_POLL: usize = 1 << 20;
    let mut at = from;
    for part in bytes[from..].chunks(BYTES_PER_POLL) {
        if let Some(step) = part.iter().position(|byte| *byte == 0xff) {
            return at + step;
        }
        at += part.len();
        poll();
    }
    at
}

fn frame(marker: u8, body: &[u8]) -> Result<JpegFrame, DecodeError> {
    let refused = |what: &str| {
        let reason = format!("it is {what}; save it as a usual JPEG of 8 bits, or as PNG");
        Err(broken(FileKind::Jpeg, &reason))
    };
    match marker {
        0xc0..=0xc2 => {}
        0xc3 | 0xcb => return refused("coded without loss"),
        0xc9 | 0xca => return refused("coded by arithmetic coding"),
        _ => return refused("coded in several frames"),
    }
    let truncated = || DecodeError::Truncated(FileKind::Jpeg);
    let precision = *body.first().ok_or_else(truncated)?;
    if precision != 8 {
        return refused(&format!("a JPEG of {precision} bits per sample"));
    }
    let [height, width] = [1, 3].map(|at| number(body, at));
    let components = body.get(6..).ok_or_else(truncated)?.as_chunks::<3>().0;
    let components = components
        .iter()
        .map(|&[id, sampling, table]| JpegComponent {
            id,
            sampling: [sampling >> 4, sampling & 15].map(usize::from),
            quantization_table: table,
        });
    Ok(JpegFrame {
        width: width.ok_or_else(truncated)?,
        height: height.ok_or_else(truncated)?,
        is_progressive: marker == 0xc2,
        components: components.take(usize::from(body[5])).collect(),
    })
}

/// Reads the header of a scan that begins at `start`. The end is not known yet.
fn scan(frame: &JpegFrame, body: &[u8], start: usize) -> Option<JpegScan> {
    let (count, rest) = body.split_first()?;
    let (ids, rest) = rest.split_at_checked(2 * usize::from(*count))?;
    let components = ids.chunks(2).map(|id| {
        let mut all = frame.components.iter();
        all.position(|component| component.id == id[0])
    });
    let &[first, last, bits, ..] = rest else {
        return None;
    };
    let (first, last) = (u32::from(first.min(63)), u32::from(last.min(63)));
    let band = (u64::MAX >> (63 - last)) & (u64::MAX << first);
    Some(JpegScan {
        range: start..0,
        components: components.collect::<Option<_>>()?,
        // The lower half: bits of the coefficients that are still missing.
        completes: if bits % 16 == 0 { band } else { 0 },
    })
}

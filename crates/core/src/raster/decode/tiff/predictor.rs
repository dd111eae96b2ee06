//! Undoes the predictors of TIFF rows.

/// Adds to each sample the same sample of the pixel to the left. `bytes` is the length of a sample.
pub(super) fn undo_horizontal(row: &mut [u8], bytes: usize, samples: usize, is_big_endian: bool) {
    match bytes {
        1 => {
            for at in samples..row.len() {
                row[at] = row[at].wrapping_add(row[at - samples]);
            }
        }
        2 => add_left(row, samples, is_big_endian, |a, b| {
            let sum = u16::from_le_bytes(a).wrapping_add(u16::from_le_bytes(b));
            sum.to_le_bytes()
        }),
        4 => add_left(row, samples, is_big_endian, |a, b| {
            let sum = u32::from_le_bytes(a).wrapping_add(u32::from_le_bytes(b));
            sum.to_le_bytes()
        }),
        _ => add_left(row, samples, is_big_endian, |a, b| {
            let sum = u64::from_le_bytes(a).wrapping_add(u64::from_le_bytes(b));
            sum.to_le_bytes()
        }),
    }
}

/// Replaces each sample by the sum of it and the sample to the left, both in little-endian order.
fn add_left<const N: usize>(
    row: &mut [u8],
    samples: usize,
    is_big_endian: bool,
    sum: impl Fn([u8; N], [u8; N]) -> [u8; N],
) {
    let (row, _) = row.as_chunks_mut::<N>();
    let swapped = |mut value: [u8; N]| {
        if is_big_endian {
            value.reverse();
        }
        value
    };
    for at in samples..row.len() {
        row[at] = swapped(sum(swapped(row[at]), swapped(row[at - samples])));
    }
}

/// Undoes the predictor of floats. A row holds the most significant bytes of all samples, then the next ones, and so on,
/// and each byte differs from the one a pixel to the left.
pub(super) fn undo_float(row: &mut [u8], bytes: usize, samples: usize, is_big_endian: bool) {
    for at in samples..row.len() {
        row[at] = row[at].wrapping_add(row[at - samples]);
    }
    let planes = row.to_vec();
    let count = row.len() / bytes;
    for (at, value) in row.chunks_exact_mut(bytes).enumerate() {
        for (byte, target) in value.iter_mut().enumerate() {
            let significance = if is_big_endian {
                byte
            } else {
                bytes - 1 - byte
            };
            *target = planes[significance * count + at];
        }
    }
}

//! Luma and chroma samples of TIFF pixels that share their chroma.

/// Returns how many blocks of pixels that share a chroma sample are side by side, and one below the other.
fn blocks(size: [usize; 2], shared: [usize; 2]) -> [usize; 2] {
    [0, 1].map(|axis| size[axis].div_ceil(shared[axis]))
}

/// Returns the bytes of a strip or tile: for each block, all of its luma samples, then two chroma samples.
pub(super) fn len(size: [usize; 2], shared: [usize; 2]) -> usize {
    let [across, down] = blocks(size, shared);
    across * down * (shared[0] * shared[1] + 2)
}

/// Returns luma and chroma samples of each pixel of a strip or tile.
pub(super) fn expand(bytes: &[u8], size: [usize; 2], shared: [usize; 2]) -> Vec<u8> {
    let ([width, height], [shared_x, shared_y]) = (size, shared);
    let [across, _] = blocks(size, shared);
    let lumas = shared_x * shared_y;
    let mut pixels = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        crate::domain::cancel::poll();
        let row = &bytes[y / shared_y * across * (lumas + 2)..];
        for x in 0..width {
            let block = &row[x / shared_x * (lumas + 2)..][..lumas + 2];
            let luma = block[y % shared_y * shared_x + x % shared_x];
            pixels.extend([luma, block[lumas], block[lumas + 1]]);
        }
    }
    pixels
}

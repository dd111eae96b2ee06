//! Drawing on colour images: copying, resizing, rectangles.

use mocban_core::raster::Grid;

/// An 8-bit colour image.
pub type Rgb = Grid<[u8; 3]>;

/// Vermillion of the palette of Okabe and Ito, which readers with colour blindness can distinguish from ink.
pub(crate) const VERMILLION: [u8; 3] = [213, 94, 0];
/// Blue of the same palette.
pub(crate) const BLUE: [u8; 3] = [0, 114, 178];
/// Orange of the same palette.
pub(crate) const ORANGE: [u8; 3] = [230, 159, 0];
/// Colour of text.
pub(super) const TEXT: [u8; 3] = [20, 20, 20];
/// Background colour.
pub(super) const BACKGROUND: [u8; 3] = [255, 255, 255];

/// Resizes an image by averaging areas along a shrinking axis, and by nearest pixels along a growing axis.
pub(crate) fn resized(image: &Rgb, width: usize, height: usize) -> Rgb {
    if (image.width(), image.height()) == (width, height) {
        return image.clone();
    }
    if width.is_multiple_of(image.width()) && height.is_multiple_of(image.height()) {
        return enlarged(image, width / image.width(), height / image.height());
    }
    let columns = spans(image.width(), width);
    let rows = spans(image.height(), height);
    Rgb::from_fn(width, height, |x, y| mean(image, &columns[x], &rows[y]))
}

/// Repeats each pixel `across` times and each row `down` times.
fn enlarged(image: &Rgb, across: usize, down: usize) -> Rgb {
    let (width, height) = (image.width() * across, image.height() * down);
    let mut out = Rgb::new(width, height, BACKGROUND);
    let rows = out.data_mut().chunks_exact_mut(width * down);
    for (y, rows) in rows.enumerate() {
        let (first, others) = rows.split_at_mut(width);
        for (pixels, colour) in first.chunks_exact_mut(across).zip(image.row(y)) {
            pixels.fill(*colour);
        }
        for row in others.chunks_exact_mut(width) {
            row.copy_from_slice(first);
        }
    }
    out
}

/// The source pixels, with weights, that contribute to one output pixel along one axis.
type Span = Vec<(usize, f64)>;

fn spans(from: usize, to: usize) -> Vec<Span> {
    let step = from as f64 / to as f64;
    (0..to)
        .map(|i| {
            let (start, end) = (i as f64 * step, (i + 1) as f64 * step);
            if step < 1.0 {
                return vec![((f64::midpoint(start, end)) as usize, 1.0)];
            }
            (start as usize..(end.ceil() as usize).min(from))
                .map(|j| (j, end.min((j + 1) as f64) - start.max(j as f64)))
                .collect()
        })
        .collect()
}

fn mean(image: &Rgb, columns: &Span, rows: &Span) -> [u8; 3] {
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for (y, wy) in rows {
        for (x, wx) in columns {
            let colour = image.at(*x, *y);
            let at = wx * wy;
            for channel in 0..3 {
                sum[channel] += at * f64::from(colour[channel]);
            }
            weight += at;
        }
    }
    sum.map(|total| (total / weight).round() as u8)
}

/// Copies an image into another, with its top left corner at (x, y). Parts outside the target are cut off.
pub(super) fn copy(onto: &mut Rgb, image: &Rgb, x: usize, y: usize) {
    for row in 0..image.height().min(onto.height().saturating_sub(y)) {
        for column in 0..image.width().min(onto.width().saturating_sub(x)) {
            onto.set(x + column, y + row, image.at(column, row));
        }
    }
}

/// Fills a rectangle with a colour, clipped.
pub(super) fn fill(onto: &mut Rgb, at: [usize; 2], size: [usize; 2], colour: [u8; 3]) {
    for y in at[1]..(at[1] + size[1]).min(onto.height()) {
        for x in at[0]..(at[0] + size[0]).min(onto.width()) {
            onto.set(x, y, colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Rgb, copy, fill, resized};

    #[test]
    fn shrinking_averages_and_growing_repeats_pixels() {
        let image = Rgb::from_vec(2, 1, vec![[0, 10, 100], [200, 30, 100]]).expect("two pixels");
        assert_eq!(resized(&image, 1, 1).data(), [[100, 20, 100]]);
        let grown = resized(&image, 4, 2);
        assert_eq!(
            grown.row(1),
            [[0, 10, 100], [0, 10, 100], [200, 30, 100], [200, 30, 100]]
        );
        assert_eq!(resized(&image, 2, 1), image);
    }

    #[test]
    fn drawing_is_clipped() {
        let mut sheet = Rgb::new(8, 8, [255; 3]);
        fill(&mut sheet, [6, 3], [9, 2], [7; 3]);
        copy(&mut sheet, &Rgb::new(5, 5, [9; 3]), 7, 7);
        assert_eq!((sheet.at(6, 3), sheet.at(7, 4)), ([7; 3], [7; 3]));
        assert_eq!(sheet.at(7, 7), [9; 3]);
    }
}

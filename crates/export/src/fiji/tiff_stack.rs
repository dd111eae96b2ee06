//! Encodes images and stacks of equal size as TIFF with the tags of `ImageJ`.

use std::io::Cursor;

use tiff::TiffResult;
use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::{ColorType, Gray16, Gray32Float};
use tiff::tags::{ResolutionUnit, Tag};

use super::imagej_tags::{ImageDisplay, PixelSize, description, metadata};
use mocban_core::raster::Grid;

/// Tags of `ImageJ`'s metadata: its content, and the lengths of the parts of the content.
const METADATA_LENGTHS: Tag = Tag::Unknown(50_838);
const METADATA: Tag = Tag::Unknown(50_839);

/// Encodes images of 32-bit floats as the channels of a stack. NaN is no data.
///
/// # Panics
/// Panics if the images have no pixels.
pub(super) fn float_stack(size: &PixelSize, channels: &[(ImageDisplay, Grid<f32>)]) -> Vec<u8> {
    stack::<Gray32Float>(size, channels)
}

/// Encodes an image of 16-bit integers.
///
/// # Panics
/// Panics if the image has no pixels.
pub(super) fn integer_image(size: &PixelSize, display: ImageDisplay, image: Grid<u16>) -> Vec<u8> {
    stack::<Gray16>(size, &[(display, image)])
}

fn stack<C>(size: &PixelSize, channels: &[(ImageDisplay, Grid<C::Inner>)]) -> Vec<u8>
where
    C: ColorType,
    C::Inner: Copy,
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    write_stack::<C>(size, channels, &mut out).expect("images with pixels are written to memory");
    out.into_inner()
}

/// Writes the images without compression, so that programs can map them into memory.
fn write_stack<C>(
    size: &PixelSize,
    channels: &[(ImageDisplay, Grid<C::Inner>)],
    out: &mut Cursor<Vec<u8>>,
) -> TiffResult<()>
where
    C: ColorType,
    C::Inner: Copy,
    [C::Inner]: tiff::encoder::TiffValue,
{
    let displays: Vec<ImageDisplay> = channels.iter().map(|(display, _)| *display).collect();
    let mut file = TiffEncoder::new(out)?;
    for (k, (_, grid)) in channels.iter().enumerate() {
        let (width, height) = (grid.width() as u32, grid.height() as u32);
        let mut image = file.new_image::<C>(width, height)?;
        image.rows_per_strip(height)?;
        image.resolution(ResolutionUnit::None, size.resolution());
        let tags = image.encoder();
        if k == 0 {
            tags.write_tag(Tag::ImageDescription, &*description(size, &displays))?;
        }
        if k == 0 && channels.len() > 1 {
            let (lengths, content) = metadata(&displays);
            tags.write_tag(METADATA_LENGTHS, &*lengths)?;
            tags.write_tag(METADATA, &*content)?;
        }
        image.write_data(grid.data())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use tiff::decoder::{Decoder, DecodingResult};
    use tiff::tags::Tag;

    use super::super::imagej_tags::{ImageDisplay, PixelSize};
    use super::{METADATA, float_stack, integer_image};
    use mocban_core::raster::Grid;

    const SIZE: PixelSize = PixelSize {
        px_per_unit: 20.0,
        unit: "mm",
    };
    const DISPLAY: ImageDisplay = ImageDisplay {
        label: "height",
        range: [0.0, 9.0],
    };

    #[test]
    fn floats_of_a_stack_are_read_back_with_calibration() {
        let images = [0.0, 0.5].map(|shift| {
            Grid::from_fn(
                5,
                3,
                |x, y| if x == y { f32::NAN } else { x as f32 + shift },
            )
        });
        let file = float_stack(&SIZE, &images.clone().map(|image| (DISPLAY, image)));
        let mut decoder = Decoder::new(Cursor::new(file)).expect("a TIFF");
        let text = decoder.get_tag_ascii_string(Tag::ImageDescription);
        assert!(text.expect("a description").contains("images=2\n"));
        let resolution = decoder.get_tag(Tag::XResolution).expect("a tag");
        let [n, d] = resolution.into_u32_vec().expect("a fraction")[..] else {
            unreachable!("a fraction has two parts");
        };
        assert_eq!(f64::from(n) / f64::from(d), 20.0);
        assert!(decoder.get_tag(METADATA).is_ok());
        for image in &images {
            let DecodingResult::F32(found) = decoder.read_image().expect("an image") else {
                unreachable!("floats were written");
            };
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&found), bits(image.data()));
            if decoder.more_images() {
                decoder.next_image().expect("the next image");
            }
        }
        assert!(!decoder.more_images());
    }

    #[test]
    fn integers_are_read_back() {
        let image = Grid::from_fn(4, 2, |x, y| (1000 * x + y) as u16);
        let file = integer_image(&SIZE, DISPLAY, image.clone());
        let mut decoder = Decoder::new(Cursor::new(file)).expect("a TIFF");
        assert!(decoder.get_tag(METADATA).is_err());
        let DecodingResult::U16(found) = decoder.read_image().expect("an image") else {
            unreachable!("integers were written");
        };
        assert_eq!(found, image.data());
    }
}

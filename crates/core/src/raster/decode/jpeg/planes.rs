//! Decodes baseline images whose colour components are coded one after the other. The decoder confuses their rows if
//! chroma has fewer samples than luma, so that each component is decoded as an image of its own.

use super::interleaved::{JpegColours, JpegSamples, interleaved};
use super::segments::{JpegComponent, JpegFrame, JpegSegments};
use crate::raster::decode::error::{DecodeError, broken};

use crate::domain::FileKind;
use crate::domain::cancel::poll;

/// Returns whether each component of a baseline image has a scan of its own.
///
/// # Errors
/// Returns an error if scans have several components, but not all, and chroma has fewer samples than luma.
pub(super) fn has_planes(
    frame: &JpegFrame,
    segments: &JpegSegments<'_>,
) -> Result<bool, DecodeError> {
    let all = frame.components.len();
    let mut scans = segments.scans.iter().map(|scan| scan.components.len());
    if frame.is_progressive || scans.clone().any(|components| components == all) {
        return Ok(false);
    }
    if all == 3 && scans.all(|components| components == 1) {
        return Ok(true);
    }
    let sampling = frame.components.iter().map(|component| component.sampling);
    if sampling.clone().all(|sampling| sampling == [1, 1]) {
        return Ok(false);
    }
    let reason = "its colours are coded in several scans of different sizes; save it as a usual JPEG or as PNG";
    Err(broken(FileKind::Jpeg, reason))
}

/// Decodes an image of three components with a scan each.
///
/// # Errors
/// Returns an error if a component is missing or damaged.
pub(super) fn decode(
    bytes: &[u8],
    frame: &JpegFrame,
    segments: &JpegSegments<'_>,
    colours: JpegColours,
) -> Result<JpegSamples, DecodeError> {
    let samplings = frame.components.iter().map(|component| component.sampling);
    let most = samplings.fold([1, 1], |most, sampling| {
        [0, 1].map(|axis| most[axis].max(sampling[axis]))
    });
    let mut planes = Vec::new();
    for (at, component) in frame.components.iter().enumerate() {
        let plane = component_image(bytes, frame, segments, at, most)?;
        let plane = interleaved(&plane, JpegColours::Stored)?;
        planes.push(UpsampledPlane {
            columns: blends(frame.width, plane.width, component.sampling[0], most[0]),
            rows: blends(frame.height, plane.height, component.sampling[1], most[1]),
            plane,
        });
    }
    let is_rgb = segments.adobe_transform == Some(0)
        || frame
            .components
            .iter()
            .map(|component| component.id)
            .eq(*b"RGB");
    let convert = colours == JpegColours::Usual && !is_rgb;
    let mut samples = vec![0; 3 * frame.width * frame.height];
    let mut rows = [(); 3].map(|()| vec![0; frame.width]);
    for (y, pixels) in samples.chunks_exact_mut(3 * frame.width).enumerate() {
        poll();
        for (plane, row) in planes.iter().zip(&mut rows) {
            plane.read_row(y, row);
        }
        for (x, pixel) in pixels.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let stored = [rows[0][x], rows[1][x], rows[2][x]];
            *pixel = if convert {
                rgb_of_ycbcr(stored)
            } else {
                stored
            };
        }
    }
    Ok(JpegSamples {
        width: frame.width,
        height: frame.height,
        channels: 3,
        samples,
    })
}

/// Returns a grey JPEG of one component: its tables, a frame of its size, and its scan.
fn component_image(
    bytes: &[u8],
    frame: &JpegFrame,
    segments: &JpegSegments<'_>,
    at: usize,
    most: [usize; 2],
) -> Result<Vec<u8>, DecodeError> {
    let JpegComponent {
        id,
        sampling,
        quantization_table,
    } = frame.components[at];
    let scan = segments.scans.iter().find(|scan| scan.components == [at]);
    let Some(scan) = scan else {
        return Err(broken(FileKind::Jpeg, "one of its colours is missing"));
    };
    let [width, height] = [(frame.width, 0), (frame.height, 1)]
        .map(|(side, axis)| (side * sampling[axis]).div_ceil(most[axis]) as u16);
    let mut image = vec![0xff, 0xd8];
    for table in segments
        .tables
        .iter()
        .filter(|table| table.start < scan.range.start)
    {
        image.extend(&bytes[table.clone()]);
    }
    image.extend([0xff, 0xc0, 0, 11, 8]);
    image.extend(height.to_be_bytes());
    image.extend(width.to_be_bytes());
    image.extend([1, id, 0x11, quantization_table]);
    image.extend(&bytes[scan.range.clone()]);
    image.extend([0xff, 0xd9]);
    Ok(image)
}

/// A component and how its samples give those of the image.
struct UpsampledPlane {
    plane: JpegSamples,
    columns: Vec<SampleBlend>,
    rows: Vec<SampleBlend>,
}

/// Two neighbouring samples and the weight of the second, in [`SampleBlend::FULL`]ths.
struct SampleBlend {
    first: usize,
    second: usize,
    weight: u32,
}

impl SampleBlend {
    const FULL: u32 = 64;
}

/// Returns how the samples of a side are blended from those of a component, which has `sampling` samples where the image
/// has `most`. The samples of a component are in the middle of the pixels that they stand for.
fn blends(side: usize, samples: usize, sampling: usize, most: usize) -> Vec<SampleBlend> {
    let last = samples.saturating_sub(1);
    let full = SampleBlend::FULL as usize;
    let blend = |pixel: usize| {
        let position = ((2 * pixel + 1) * sampling * full).saturating_sub(most * full) / (2 * most);
        SampleBlend {
            first: (position / full).min(last),
            second: (position / full + 1).min(last),
            weight: (position % full) as u32,
        }
    };
    (0..side).map(blend).collect()
}

impl UpsampledPlane {
    fn read_row(&self, y: usize, row: &mut [u8]) {
        const HALF: u32 = SampleBlend::FULL * SampleBlend::FULL / 2;
        let blend = &self.rows[y];
        let source = |y: usize| &self.plane.samples[y * self.plane.width..][..self.plane.width];
        let (above, below) = (source(blend.first), source(blend.second));
        let (down, up) = (blend.weight, SampleBlend::FULL - blend.weight);
        for (
            value,
            SampleBlend {
                first,
                second,
                weight,
            },
        ) in row.iter_mut().zip(&self.columns)
        {
            let column = |x: usize| u32::from(above[x]) * up + u32::from(below[x]) * down;
            let sum = column(*first) * (SampleBlend::FULL - weight) + column(*second) * weight;
            *value = ((sum + HALF) / (SampleBlend::FULL * SampleBlend::FULL)) as u8;
        }
    }
}

/// Converts luma and chroma to red, green and blue, as JFIF defines them.
fn rgb_of_ycbcr([y, b, r]: [u8; 3]) -> [u8; 3] {
    let y = (i32::from(y) << 16) + (1 << 15);
    let (b, r) = (i32::from(b) - 128, i32::from(r) - 128);
    // 1.402, 0.344136, 0.714136 and 1.772 in 65,536ths.
    let sums = [y + 91_881 * r, y - 22_554 * b - 46_802 * r, y + 116_130 * b];
    sums.map(|sum| (sum >> 16).clamp(0, 255) as u8)
}

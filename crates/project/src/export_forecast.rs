//! About how large an export will be, from the first pairs with a result.

use crate::blocking::blocking;
use crate::error::ProjectResult;
use crate::file_headers::image_size;
use mocban_catalog::{Catalog, PairFilter, PairOrder, PairResults};
use mocban_core::domain::{JobStatus, ThresholdMetric};
use mocban_core::raster::ImageLimits;
use mocban_export::{ExportFormat, ExportedSizes, PrintFileSize, shared_bytes};
use mocban_store::Project;

/// Most pairs from which the others are estimated. The headers of their prints are read.
const SAMPLED: usize = 32;

/// What is known before an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportForecast {
    /// Pairs with a result.
    pub pairs: u64,
    sample: Vec<ExportedSizes>,
    blocks: u64,
    verdicts: u64,
}

impl ExportForecast {
    /// Reads counters, the first pairs with a result, and the headers of their prints. The work does not grow with the number of
    /// pairs.
    pub async fn read(
        project: &Project,
        catalog: &Catalog,
        limits: ImageLimits,
    ) -> ProjectResult<Self> {
        let counts = catalog.counters().await?.into_iter();
        let done = counts.filter(|((_, status), _)| *status == JobStatus::Done);
        let pairs = done.map(|(_, pairs)| pairs).sum();
        let filter = PairFilter {
            statuses: vec![JobStatus::Done],
            ..PairFilter::default()
        };
        let (order, metric) = (PairOrder::Imported, ThresholdMetric::DEFAULT);
        let first = catalog.pair_list(&filter, order, metric, None, SAMPLED);
        let first = first.await?.pairs;
        let project = project.clone();
        let measure = move || {
            let sizes = first
                .iter()
                .filter_map(|pair| ExportedSizes::of(pair, print_size(&project, pair, &limits)));
            sizes.collect::<Vec<_>>()
        };
        Ok(Self {
            pairs,
            sample: blocking(measure).await?,
            blocks: catalog.count_blocks().await?,
            verdicts: catalog.count_verdicts().await?,
        })
    }

    /// Estimates the bytes of an export of all pairs with a result under all metrics; see [`ExportedSizes::bytes`]. Returns `None` if
    /// there are such pairs, and none of the first can be read.
    pub fn bytes(&self, format: ExportFormat, canvas_px: Option<u32>) -> Option<u64> {
        let shared = shared_bytes(format, self.blocks, self.verdicts);
        if self.pairs == 0 {
            return Some(shared);
        }
        let sizes = self.sample.iter();
        let sizes = sizes.map(|sizes| sizes.bytes(format, canvas_px));
        let sum = sizes.fold(0, u64::saturating_add);
        let mean = sum.checked_div(self.sample.len() as u64)?;
        Some(shared.saturating_add(mean.saturating_mul(self.pairs)))
    }
}

/// Returns the sizes of the print of a pair. `None` if it is in an object store or cannot be used.
fn print_size(
    project: &Project,
    pair: &PairResults,
    limits: &ImageLimits,
) -> Option<PrintFileSize> {
    let input = project.input(&pair.attributes.print_path);
    if input.is_remote() {
        return None;
    }
    let [width, height] = image_size(input.path(), limits).ok()?;
    Some(PrintFileSize {
        bytes: input.size(),
        pixels: u64::from(width) * u64::from(height),
    })
}

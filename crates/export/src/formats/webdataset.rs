//! The format `webdataset`: tar shards with one sample per pair, for `webdataset` and `torch.utils.data`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;

use tar::{Builder, Header};

use crate::export_folder::{FolderError, at};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::record::{PairRecord, SplitName};
use crate::record_fields::{METRIC_FIELDS, PAIR_FIELDS, markdown_table};
use crate::sample::{PICTURE_FIELDS, chosen, fields, pictures, schema};

/// Size of a block of a tar file, in bytes. A file takes one for its header, and its content is padded to blocks.
const BLOCK: u64 = 512;

/// Writes the shards.
pub(super) struct WebDatasetWriter {
    folder: FormatFolder,
    parts: BTreeMap<Option<SplitName>, ShardSeries>,
}

/// The shards of one part of the dataset.
#[derive(Default)]
struct ShardSeries {
    shard: Option<TarShard>,
    files: Vec<String>,
}

/// A shard in progress.
struct TarShard {
    path: PathBuf,
    tar: Builder<BufWriter<File>>,
    bytes: u64,
}

impl WebDatasetWriter {
    pub(super) fn begin(folder: FormatFolder) -> Self {
        Self {
            folder,
            parts: BTreeMap::new(),
        }
    }
}

impl FormatWriter for WebDatasetWriter {
    /// Encodes the files of the sample: extensions and contents in turn.
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let mut encoded = EncodedPair::default();
        let index = chosen(&view.record.metrics);
        if let (Some(result), Some(index), Some(fields)) = (view.result, index, fields(view.record))
        {
            encoded
                .shared
                .extend([b"json".to_vec(), fields.to_string().into_bytes()]);
            for picture in pictures(result, result.metrics[index], false)? {
                let name = format!("{}.{}", picture.name, picture.extension);
                encoded.shared.extend([name.into_bytes(), picture.bytes]);
            }
        }
        Ok(encoded)
    }

    fn append(&mut self, record: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        if shared.is_empty() {
            return Ok(());
        }
        let contents = shared.iter().skip(1).step_by(2);
        let size: u64 = contents
            .map(|file| BLOCK + (file.len() as u64).next_multiple_of(BLOCK))
            .sum();
        let split = record.pair.split;
        let series = self.parts.entry(split).or_default();
        let limit = self.folder.context.options.shard_bytes();
        if let Some(full) = series.shard.take_if(|shard| shard.bytes + size > limit) {
            full.finish()?;
        }
        let mut shard = if let Some(shard) = series.shard.take() {
            shard
        } else {
            let part = split.map_or("pairs", SplitName::name);
            let name = format!("{part}-{:06}.tar", series.files.len());
            let shard = TarShard::create(self.folder.root.join(&name))?;
            series.files.push(name);
            shard
        };
        let mut files = shared.into_iter();
        // The reader takes the text before the first dot as the key.
        let key = record.pair.id.file_name().replace('.', "%2E");
        while let (Some(extension), Some(bytes)) = (files.next(), files.next()) {
            let extension = String::from_utf8_lossy(&extension).into_owned();
            shard.append(&format!("{key}.{extension}"), &bytes)?;
        }
        shard.bytes += size;
        series.shard = Some(shard);
        Ok(())
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        let mut files = Vec::new();
        for series in self.parts.values_mut() {
            if let Some(shard) = series.shard.take() {
                shard.finish()?;
            }
            files.append(&mut series.files);
        }
        Ok(files)
    }

    fn guide(&self) -> FormatGuide {
        let schema = schema();
        let tables = [
            ("Fields of `ID.json`", &PAIR_FIELDS[..]),
            ("", &METRIC_FIELDS[..]),
        ];
        let mut files = vec![
            [
                "PART-NUMBER.tar".to_owned(),
                "a shard; PART is `train`, `validation` or `test`, or `pairs` without a split"
                    .to_owned(),
            ],
            [
                "ID.json".to_owned(),
                "in a shard: the fields of the pair".to_owned(),
            ],
        ];
        for (field, meaning) in PICTURE_FIELDS {
            files.push([
                format!("ID.{}.png", field.name),
                format!("in a shard: {meaning}"),
            ]);
        }
        FormatGuide {
            purpose: "Scans of carved woodblock characters aligned with images of their prints: tar shards with one sample per pair. Pairs without a result are left out; the formats `jsonl` and `csv` list them.".to_owned(),
            files,
            usage: "\
The numbers from `metric` on and the pictures belong to one metric: `ensemble` if it was selected, otherwise the first.
`metrics` holds the numbers of all selected metrics. The key of a sample is the id of the pair.

```python
import webdataset
pairs = webdataset.WebDataset(\"train-000000.tar\", shardshuffle=False).decode(\"pil\")
for pair in pairs.to_tuple(\"print.png\", \"aligned_mask.png\", \"json\"):
    ...
```

`decode(\"pil\")` reduces pictures to 8 bits. For the 16 bits of the depth maps, leave `decode` out and open the bytes:
`PIL.Image.open(io.BytesIO(pair[\"depth.png\"]))`."
            .to_owned(),
            fields: markdown_table(&schema, &tables),
            schema: Some(schema),
            ..FormatGuide::default()
        }
    }
}

impl TarShard {
    fn create(path: PathBuf) -> Result<Self, FolderError> {
        let file = File::create(&path).map_err(at(&path))?;
        Ok(Self {
            tar: Builder::new(BufWriter::new(file)),
            path,
            bytes: 0,
        })
    }

    /// Appends a file. Its header holds no times and no owner, so that equal samples give equal bytes.
    fn append(&mut self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let mut header = Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(0);
        let appended = self.tar.append_data(&mut header, name, bytes);
        appended.map_err(at(&self.path))
    }

    fn finish(self) -> Result<(), FolderError> {
        let file = self.tar.into_inner();
        let flushed = file.and_then(|mut file| file.flush());
        flushed.map_err(at(&self.path))
    }
}

//! Decodes columns into domain types. An invalid value is an error.

use serde_json::Value;
use sqlx::error::BoxDynError;

use crate::db::error::CatalogError;
use crate::db::row::Row;
use crate::db::value::{FromValue, Value as ColumnValue, read_blob, read_text};
use mocban_core::domain::{
    Affine2, AttentionCheck, BlockCharacterState, BlockId, BlockName, BlockSide, BlockStage,
    ContentHash, Failure, FailureClass, InputVersion, JobStatus, LengthUnit, PairId, PairName,
    PrintFromMesh, Reason, RetireCause, ReviewOrder, Stage, ThresholdMetric, Verdict, WorkerId,
};

/// Implements [`FromValue`] for domain types. Each line has a type, the type of its column, and a conversion function.
macro_rules! decode {
    ($($type:ty: $column:ident = $convert:expr;)+) => {$(
        impl FromValue for $type {
            fn from_value(value: ColumnValue<'_>) -> Result<Self, BoxDynError> {
                decode!(@$column value, $convert)
            }
        }
    )+};
    (@integer $value:ident, $convert:expr) => { Ok($convert(i64::from_value($value)?)?) };
    (@text $value:ident, $convert:expr) => { read_text(&$value, |text| $convert(text)) };
    (@blob $value:ident, $convert:expr) => { read_blob(&$value, $convert) };
}

decode! {
    PairId: integer = |id| Ok::<_, String>(Self(id));
    WorkerId: integer = |id| Ok::<_, String>(Self(id));
    BlockId: integer = |id| Ok::<_, String>(Self(id));
    JobStatus: integer = status;
    Stage: integer = stage;
    BlockStage: integer = block_stage;
    ContentHash: blob = hash;
    PairName: text = str::parse;
    BlockName: text = str::parse;
    BlockSide: text = str::parse;
    BlockCharacterState: text = str::parse;
    FailureClass: text = str::parse;
    LengthUnit: text = str::parse;
    Reason: text = str::parse;
    ReviewOrder: text = str::parse;
    ThresholdMetric: text = str::parse;
    Verdict: text = str::parse;
    RetireCause: text = str::parse;
    Affine2: text = serde_json::from_str;
    AttentionCheck: text = serde_json::from_str;
    PrintFromMesh: text = serde_json::from_str;
}

fn status(code: i64) -> Result<JobStatus, String> {
    JobStatus::from_code(code).ok_or_else(|| format!("job status {code} is unknown"))
}

fn stage(index: i64) -> Result<Stage, String> {
    let stage = usize::try_from(index).ok().and_then(Stage::from_index);
    stage.ok_or_else(|| format!("stage {index} is unknown"))
}

fn block_stage(index: i64) -> Result<BlockStage, String> {
    let stage = usize::try_from(index).ok().and_then(BlockStage::from_index);
    stage.ok_or_else(|| format!("stage {index} of a block is unknown"))
}

fn hash(bytes: &[u8]) -> Result<ContentHash, String> {
    match bytes.try_into() {
        Ok(bytes) => Ok(ContentHash::from_bytes(bytes)),
        Err(_) => Err(format!("a hash of {} bytes", bytes.len())),
    }
}

/// Reads the version of an input file, such as `mesh`, from the columns with its hash and its `stat`.
pub(crate) fn input_version(row: &Row, file: &str) -> Result<Option<InputVersion>, CatalogError> {
    let hash: Option<_> = row.get(&*format!("{file}_hash"))?;
    let stat: Option<_> = row.get(&*format!("{file}_stat"))?;
    let both = hash.zip(stat);
    Ok(both.map(|(hash, stat)| InputVersion { hash, stat }))
}

/// Reads class and message of a failure, if there is one.
pub(crate) fn failure(row: &Row) -> Result<Option<Failure>, CatalogError> {
    let (class, message): (Option<_>, Option<String>) = (row.get("class")?, row.get("message")?);
    let both = class.zip(message);
    Ok(both.map(|(class, message)| Failure { class, message }))
}

/// Builds a JSON array of names for `json_each`.
pub(crate) fn names_json(names: &[PairName]) -> String {
    json_array(names.iter().map(PairName::as_str))
}

/// Builds a JSON array for `json_each`.
pub(crate) fn json_array<T: Into<Value>>(items: impl IntoIterator<Item = T>) -> String {
    items.into_iter().collect::<Value>().to_string()
}

//! Decodes columns into domain types. An invalid value is an error.

use serde_json::Value;
use sqlx::error::BoxDynError;
use sqlx::sqlite::{SqliteTypeInfo, SqliteValueRef};
use sqlx::{Decode, Sqlite, Type};

use crate::domain::{
    Affine2, AttentionCheck, ContentHash, FailureClass, JobStatus, LengthUnit, PairId, PairName,
    PrintFromMesh, Reason, ReviewOrder, Stage, ThresholdMetric, Verdict, WorkerId,
};

/// Implements `Type` and `Decode` for types. Each line has a type, the type of its column, and a conversion function.
macro_rules! decode {
    ($($type:ty: $column:ty = $convert:expr;)+) => {$(
        impl Type<Sqlite> for $type {
            fn type_info() -> SqliteTypeInfo {
                <$column as Type<Sqlite>>::type_info()
            }

            fn compatible(ty: &SqliteTypeInfo) -> bool {
                <$column as Type<Sqlite>>::compatible(ty)
            }
        }

        impl<'r> Decode<'r, Sqlite> for $type {
            fn decode(value: SqliteValueRef<'r>) -> Result<Self, BoxDynError> {
                let column = <$column as Decode<Sqlite>>::decode(value)?;
                Ok($convert(column)?)
            }
        }
    )+};
}

decode! {
    PairId: i64 = |id| Ok::<_, String>(Self(id));
    WorkerId: i64 = |id| Ok::<_, String>(Self(id));
    JobStatus: i64 = status;
    Stage: i64 = stage;
    ContentHash: &[u8] = hash;
    PairName: &str = str::parse;
    FailureClass: &str = str::parse;
    LengthUnit: &str = str::parse;
    Reason: &str = str::parse;
    ReviewOrder: &str = str::parse;
    ThresholdMetric: &str = str::parse;
    Verdict: &str = str::parse;
    Affine2: &str = serde_json::from_str;
    AttentionCheck: &str = serde_json::from_str;
    PrintFromMesh: &str = serde_json::from_str;
}

fn status(code: i64) -> Result<JobStatus, String> {
    JobStatus::from_code(code).ok_or_else(|| format!("job status {code} is unknown"))
}

fn stage(index: i64) -> Result<Stage, String> {
    let stage = usize::try_from(index).ok().and_then(Stage::from_index);
    stage.ok_or_else(|| format!("stage {index} is unknown"))
}

fn hash(bytes: &[u8]) -> Result<ContentHash, String> {
    match bytes.try_into() {
        Ok(bytes) => Ok(ContentHash::from_bytes(bytes)),
        Err(_) => Err(format!("a hash of {} bytes", bytes.len())),
    }
}

/// Builds a JSON array of names for `json_each`.
pub(crate) fn names_json(names: &[PairName]) -> String {
    json_array(names.iter().map(PairName::as_str))
}

/// Builds a JSON array for `json_each`.
pub(crate) fn json_array<T: Into<Value>>(items: impl IntoIterator<Item = T>) -> String {
    items.into_iter().collect::<Value>().to_string()
}

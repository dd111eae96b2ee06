//! Size of labels in JSON, counted before any value is built, because small values take much more memory than text.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::error::LabelsProblem;
use super::page_fit::MAX_BOXES;
use mocban_core::domain::cancel::PollCounter;

/// Most memory that the values of a file may take, in bytes.
const MAX_BYTES: usize = 384 << 20;
/// Estimates of the memory of a value in an array or object, and of the storage of an object and of each key.
const VALUE: usize = 48;
const OBJECT: usize = 640;
const ENTRIES_PER_NODE: usize = 6;
const KEY: usize = 24;

/// Keys of lists with the boxes of one page.
const BOX_LISTS: [&str; 2] = ["bboxes", "shapes"];

/// Checks that the values of a JSON text fit a limit of memory, and that a list of boxes is not too long. Ignores errors of
/// syntax, which the parser reports.
pub(super) fn check(text: &str) -> Result<(), LabelsProblem> {
    let mut size = JsonSize::default();
    let root = Counted {
        size: &mut size,
        level: Level::Root,
    };
    // A value that exceeds a limit ends the count.
    let _ = root.deserialize(&mut serde_json::Deserializer::from_str(text));
    size.problem.map_or(Ok(()), Err)
}

#[derive(Default)]
struct JsonSize {
    bytes: usize,
    counter: PollCounter,
    problem: Option<LabelsProblem>,
}

impl JsonSize {
    fn add<E: Error>(&mut self, bytes: usize) -> Result<(), E> {
        self.counter.tick();
        self.bytes = self.bytes.saturating_add(bytes);
        if self.bytes <= MAX_BYTES {
            return Ok(());
        }
        let limit = MAX_BYTES;
        self.refuse(LabelsProblem::TooManyValues { limit })
    }

    fn refuse<E: Error>(&mut self, problem: LabelsProblem) -> Result<(), E> {
        self.problem = Some(problem);
        Err(E::custom("a limit is exceeded"))
    }
}

/// Where a value stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Level {
    Root,
    /// A list of boxes, if it is a list.
    Boxes,
    Other,
}

/// A value that is counted and not built.
struct Counted<'a> {
    size: &'a mut JsonSize,
    level: Level,
}

impl<'de> DeserializeSeed<'de> for Counted<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Counted<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        self.size.add(VALUE)
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<(), E> {
        self.size.add(VALUE)
    }

    fn visit_i64<E: Error>(self, _: i64) -> Result<(), E> {
        self.size.add(VALUE)
    }

    fn visit_u64<E: Error>(self, _: u64) -> Result<(), E> {
        self.size.add(VALUE)
    }

    fn visit_f64<E: Error>(self, _: f64) -> Result<(), E> {
        self.size.add(VALUE)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<(), E> {
        self.size.add(VALUE + text.len())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let Self { size, level } = self;
        size.add(VALUE)?;
        let is_box_list = level != Level::Other;
        let mut count = 0;
        let level = Level::Other;
        loop {
            let size = &mut *size;
            if items.next_element_seed(Counted { size, level })?.is_none() {
                break;
            }
            count += 1;
            if is_box_list && count > MAX_BOXES {
                let limit = MAX_BOXES;
                return size.refuse(LabelsProblem::TooManyBoxes { limit });
            }
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<(), A::Error> {
        let Self { size, level } = self;
        let mut count = 0_usize;
        while let Some(key) = entries.next_key::<String>()? {
            if count.is_multiple_of(ENTRIES_PER_NODE) {
                size.add(OBJECT)?;
            }
            count += 1;
            size.add(KEY + key.len())?;
            let level = match level {
                Level::Root if BOX_LISTS.contains(&key.as_str()) => Level::Boxes,
                _ => Level::Other,
            };
            let size = &mut *size;
            entries.next_value_seed(Counted { size, level })?;
        }
        size.add(VALUE)
    }
}

//! The format `csv`: a table with one row per pair and metric, for spreadsheets and R, and a second one with the matrices.

use ::csv::{Terminator, WriterBuilder};
use serde_json::{Map, Value};

use super::csv_cell::{cell, list_cell, text_cell};
use crate::export_folder::{FolderError, SharedFile};
use crate::format_writer::{EncodedPair, FormatFolder, FormatGuide, FormatWriter, PairView};
use crate::pair_pictures::PictureError;
use crate::record::{MetricFields, PairFields, PairRecord, ReviewerFields};
use crate::record_fields::{METRIC_FIELDS, PAIR_FIELDS, markdown_table, schema_of};

/// The table of numbers and texts.
const TABLE: &str = "pairs.csv";
/// The table of matrices, with the same rows.
const MATRICES: &str = "matrices.csv";
/// Fields that `pairs.csv` begins with: what people look for. The others follow in the order of the fields.
const FIRST_FIELDS: [&str; 19] = [
    "id",
    "character",
    "block",
    "metric",
    "verdict",
    "confidence",
    "ssim",
    "nl_ssim",
    "iou",
    "iou_box",
    "dice",
    "angle_deg",
    "scale",
    "shift_px",
    "threshold_depth",
    "status",
    "error_class",
    "error",
    "verdicts",
];
/// Columns by which the rows of `matrices.csv` are joined with those of `pairs.csv`.
const KEYS: [&str; 2] = ["id", "metric"];
/// Mark by which Excel recognizes UTF-8.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Fixed lengths of the lists that become one column per element.
const LISTS: [(&str, &[usize]); 12] = [
    ("box", &[4]),
    ("plane_from_mesh", &[4, 4]),
    ("depth_from_plane", &[2, 3]),
    ("canvas_from_print", &[2, 3]),
    ("picture_from_print", &[2, 3]),
    ("page_from_crop", &[3, 3]),
    ("page_from_mesh", &[3, 4]),
    ("depth_size_px", &[2]),
    ("curvature", &[6]),
    ("shift_px", &[2]),
    ("print_from_mesh", &[3, 4]),
    ("print_from_depth", &[3, 3]),
];

/// Beginning of the pointers of the columns of the user's list.
const META: &str = "/meta/";

/// A column and where its value is in the JSON of a row.
struct ResultColumn {
    name: String,
    pointer: String,
}

impl ResultColumn {
    /// Returns whether this is a column of the user's list.
    fn is_meta(&self) -> bool {
        self.pointer.starts_with(META)
    }
}

/// A table of an export.
struct CsvTable {
    columns: Vec<ResultColumn>,
    file: SharedFile,
    /// Whether numbers have decimal commas, and columns are separated by semicolons.
    has_decimal_commas: bool,
}

impl CsvTable {
    /// Creates the file of a table, with its header.
    fn begin(folder: &FormatFolder, name: &str, fields: &[&str]) -> Result<Self, FolderError> {
        let mut file = SharedFile::create(&folder.root, name)?;
        if folder.context.options.csv_bom {
            file.append(BYTE_ORDER_MARK)?;
        }
        let columns = columns(fields, &folder.context.meta_columns);
        let header = columns.iter().map(|column| text_cell(&column.name));
        let has_decimal_commas = folder.context.options.csv_decimal_comma;
        file.append(&rows([header.collect()], has_decimal_commas))?;
        Ok(Self {
            columns,
            file,
            has_decimal_commas,
        })
    }

    /// Returns rows of the table from the fields of results.
    fn encode(&self, results: &[Value]) -> Vec<u8> {
        let cells = |result: &Value| {
            let cell_of = |column: &ResultColumn| {
                let value = result.pointer(&column.pointer);
                let encode = if column.is_meta() { list_cell } else { cell };
                value.map_or_else(String::new, |value| encode(value, self.has_decimal_commas))
            };
            self.columns.iter().map(cell_of).collect()
        };
        rows(results.iter().map(cells), self.has_decimal_commas)
    }
}

/// Writes `pairs.csv` and `matrices.csv`.
pub(super) struct CsvWriter {
    folder: FormatFolder,
    tables: [CsvTable; 2],
}

impl CsvWriter {
    pub(super) fn begin(folder: FormatFolder) -> Result<Self, FolderError> {
        let tables = [
            CsvTable::begin(&folder, TABLE, &table_fields())?,
            CsvTable::begin(&folder, MATRICES, &matrix_fields())?,
        ];
        Ok(Self { folder, tables })
    }

    /// Returns the fields of a pair and metric.
    fn fields(pair: &Map<String, Value>, metric: &MetricFields) -> Value {
        let mut fields = pair.clone();
        fields["verdicts_text"] = judgements(&metric.verdicts).into();
        if let Ok(Value::Object(of_metric)) = serde_json::to_value(metric) {
            fields.extend(of_metric);
        }
        Value::Object(fields)
    }
}

impl FormatWriter for CsvWriter {
    fn encode(&self, view: &PairView<'_>) -> Result<EncodedPair, PictureError> {
        let pair = pair_values(&view.record.pair);
        let metrics = self.folder.context.metrics.iter().copied();
        let missing: Vec<_> = if view.record.metrics.is_empty() {
            metrics.map(MetricFields::without_result).collect()
        } else {
            Vec::new()
        };
        let metrics = view.record.metrics.iter().chain(&missing);
        let results: Vec<Value> = metrics.map(|metric| Self::fields(&pair, metric)).collect();
        Ok(EncodedPair {
            files: Vec::new(),
            shared: self
                .tables
                .iter()
                .map(|table| table.encode(&results))
                .collect(),
        })
    }

    fn append(&mut self, _: &PairRecord, shared: Vec<Vec<u8>>) -> Result<(), FolderError> {
        let mut tables = self.tables.iter_mut().zip(shared);
        tables.try_for_each(|(table, rows)| table.file.append(&rows))
    }

    fn finish(&mut self) -> Result<Vec<String>, FolderError> {
        for table in &mut self.tables {
            table.file.flush()?;
        }
        Ok([TABLE, MATRICES].map(str::to_owned).to_vec())
    }

    fn guide(&self) -> FormatGuide {
        let tables = [("Columns", &PAIR_FIELDS[..]), ("", &METRIC_FIELDS[..])];
        let has_decimal_commas = self.folder.context.options.csv_decimal_comma;
        let (separated, read) = if has_decimal_commas {
            ("separated by semicolons, with decimal commas", "read.csv2")
        } else {
            ("comma-separated", "read.csv")
        };
        FormatGuide {
            purpose: "Results of block scans aligned with prints, as a table with one row per pair and metric.".to_owned(),
            files: vec![
                [TABLE.to_owned(), format!("numbers and texts: UTF-8, {separated}, lines end with CR LF")],
                [MATRICES, "matrices of the same rows, by `id` and `metric`"].map(str::to_owned),
            ],
            usage: "\
Elements of lists and matrices are columns with their indices from 1: `print_from_mesh_2_4` is row 2, column 4. The
user's columns begin with `meta_`. `curvature_1` to `curvature_6` are `height_from_mesh.curvature`. `verdicts` lists
the newest verdict of each reviewer, as `lan=pass; minh=fail (angle)`. A text that a spreadsheet would run as a formula
begins with `'`.

```r
pairs <- READ(\"pairs.csv\", fileEncoding = \"UTF-8-BOM\")
matrices <- READ(\"matrices.csv\", fileEncoding = \"UTF-8-BOM\")
pairs <- merge(pairs, matrices, by = c(\"id\", \"metric\"))
```"
            .replace("READ", read),
            fields: markdown_table(&schema_of::<RowSchema>(), &tables),
            ..FormatGuide::default()
        }
    }
}

/// The fields of a row, for the README.
#[derive(schemars::JsonSchema)]
struct RowSchema {
    #[serde(flatten)]
    _pair: PairFields,
    #[serde(flatten)]
    _metric: MetricFields,
}

/// Returns whether a field is in `matrices.csv`: maps and surfaces, which few people read by eye.
fn is_matrix(field: &str) -> bool {
    let is_two_dimensional =
        |(list, lengths): &(&str, &[usize])| *list == field && lengths.len() == 2;
    field == "height_from_mesh" || LISTS.iter().any(is_two_dimensional)
}

/// Returns all fields, in their order.
fn all_fields() -> impl Iterator<Item = &'static str> {
    PAIR_FIELDS
        .iter()
        .chain(&METRIC_FIELDS)
        .map(|field| field.name)
}

/// Returns the fields of `pairs.csv`.
fn table_fields() -> Vec<&'static str> {
    let others = all_fields().filter(|name| !FIRST_FIELDS.contains(name) && !is_matrix(name));
    FIRST_FIELDS.into_iter().chain(others).collect()
}

/// Returns the fields of `matrices.csv`.
fn matrix_fields() -> Vec<&'static str> {
    let matrices = all_fields().filter(|name| is_matrix(name));
    KEYS.into_iter().chain(matrices).collect()
}

/// Returns the columns of fields.
fn columns(fields: &[&str], meta: &[String]) -> Vec<ResultColumn> {
    let mut columns = Vec::new();
    for name in fields {
        match *name {
            "meta" => columns.extend(meta.iter().map(|key| ResultColumn {
                name: format!("meta_{key}"),
                pointer: format!("{META}{}", key.replace('~', "~0").replace('/', "~1")),
            })),
            "height_from_mesh" => {
                add_list(&mut columns, "curvature", "/height_from_mesh/curvature");
            }
            "manual_alignment" => {
                for name in ["reviewer", "at", "iou", "dice", "note"] {
                    columns.push(ResultColumn {
                        name: format!("manual_alignment_{name}"),
                        pointer: format!("/manual_alignment/{name}"),
                    });
                }
            }
            "displaced" => {
                for name in ["ink_share", "angle_deg", "shift_px"] {
                    let before = columns.len();
                    add_list(&mut columns, name, &format!("/displaced/{name}"));
                    for column in &mut columns[before..] {
                        column.name.insert_str(0, "displaced_");
                    }
                }
            }
            "verdicts" => columns.push(ResultColumn {
                name: "verdicts".to_owned(),
                pointer: "/verdicts_text".to_owned(),
            }),
            name => add_list(&mut columns, name, &format!("/{name}")),
        }
    }
    columns
}

/// Adds a column for a value, or one for each element if it is a list.
fn add_list(columns: &mut Vec<ResultColumn>, name: &str, pointer: &str) {
    let lengths = LISTS.iter().find(|(list, _)| *list == name);
    let mut places = vec![(name.to_owned(), pointer.to_owned())];
    for length in lengths.map_or(&[][..], |(_, lengths)| lengths) {
        places = places
            .iter()
            .flat_map(|(name, pointer)| {
                (0..*length).map(move |i| (format!("{name}_{}", i + 1), format!("{pointer}/{i}")))
            })
            .collect();
    }
    columns.extend(
        places
            .into_iter()
            .map(|(name, pointer)| ResultColumn { name, pointer }),
    );
}

/// Returns the fields of a pair by name.
fn pair_values(pair: &PairFields) -> Map<String, Value> {
    match serde_json::to_value(pair) {
        Ok(Value::Object(mut fields)) => {
            fields.insert("verdicts_text".to_owned(), Value::Null);
            fields
        }
        Ok(_) | Err(_) => Map::new(),
    }
}

/// Returns the reviewers' verdicts as text, such as `lan=pass; minh=fail (angle)`.
fn judgements(verdicts: &[ReviewerFields]) -> String {
    let each = verdicts.iter().map(|given| {
        let reason = given
            .reason
            .map_or(String::new(), |reason| format!(" ({reason})"));
        format!("{}={}{reason}", given.reviewer, given.verdict)
    });
    each.collect::<Vec<_>>().join("; ")
}

/// Returns rows as CSV (RFC 4180), with semicolons between the columns beside decimal commas.
fn rows(rows: impl IntoIterator<Item = Vec<String>>, has_decimal_commas: bool) -> Vec<u8> {
    let mut writer = WriterBuilder::new()
        .delimiter(if has_decimal_commas { b';' } else { b',' })
        .terminator(Terminator::CRLF)
        .from_writer(Vec::new());
    for row in rows {
        writer
            .write_record(row)
            .expect("memory takes rows of equal length");
    }
    writer.into_inner().expect("memory is written")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{FIRST_FIELDS, all_fields, cell, columns, matrix_fields, rows, table_fields};

    fn names(fields: &[&str]) -> Vec<String> {
        let columns = columns(fields, &["tờ".to_owned()]);
        columns.into_iter().map(|column| column.name).collect()
    }

    #[test]
    fn the_table_begins_with_what_people_look_for_and_has_no_matrices() {
        let names = names(&table_fields());
        assert_eq!(
            names[..6],
            [
                "id",
                "character",
                "block",
                "metric",
                "verdict",
                "confidence"
            ]
        );
        assert_eq!(names[11..14], ["angle_deg", "scale", "shift_px_1"]);
        assert!(names.contains(&"meta_tờ".to_owned()), "{names:?}");
        assert!(
            names.iter().all(|name| !name.contains("_from_")),
            "{names:?}"
        );
    }

    #[test]
    fn every_field_is_in_one_of_the_tables() {
        let (table, matrices) = (table_fields(), matrix_fields());
        for field in all_fields() {
            let is_key = ["id", "metric"].contains(&field);
            assert_eq!(
                table.contains(&field) && matrices.contains(&field),
                is_key,
                "{field}"
            );
            assert!(
                table.contains(&field) || matrices.contains(&field),
                "{field}"
            );
        }
        assert!(
            FIRST_FIELDS
                .iter()
                .all(|name| all_fields().any(|field| field == *name))
        );
        let names = names(&matrices);
        assert_eq!(names[..3], ["id", "metric", "plane_from_mesh_1_1"]);
        assert!(names.contains(&"curvature_6".to_owned()), "{names:?}");
        assert_eq!(
            names.last().map(String::as_str),
            Some("print_from_depth_3_3")
        );
    }

    #[test]
    fn decimal_commas_come_with_semicolons() {
        let values = [json!("a;b"), json!(-0.25), json!(3), json!("1.5")];
        let row = values.iter().map(|value| cell(value, true));
        let row = rows([row.collect()], true);
        assert_eq!(row, b"\"a;b\";-0,25;3;1.5\r\n");
    }
}

//! Errors of formulas, which spreadsheet programs write to CSV as text.

use std::collections::BTreeMap;

use serde_json::Value;

use super::column_names::shown_column;

/// Texts of failed formulas.
const ERRORS: [&str; 16] = [
    "#BLOCKED!",
    "#BUSY!",
    "#CALC!",
    "#CONNECT!",
    "#DIV/0!",
    "#ERROR!",
    "#FIELD!",
    "#GETTING_DATA",
    "#N/A",
    "#NAME?",
    "#NULL!",
    "#NUM!",
    "#REF!",
    "#SPILL!",
    "#UNKNOWN!",
    "#VALUE!",
];

/// Begins the errors of `LibreOffice` that have a number, such as `Err:502`.
const NUMBERED: &str = "Err:";

/// Returns the error of a formula that a text is, such as `#REF!`.
pub fn formula_error(text: &str) -> Option<&str> {
    // Most cells are no error, so only the first byte of each is looked at.
    match text.as_bytes() {
        [b'#', ..] => {
            let mut errors = ERRORS.iter();
            errors
                .find(|error| error.eq_ignore_ascii_case(text))
                .copied()
        }
        [b'E', ..] => {
            let number = text.strip_prefix(NUMBERED)?;
            let is_number = number.len() == 3 && number.bytes().all(|byte| byte.is_ascii_digit());
            is_number.then_some(text)
        }
        _ => None,
    }
}

/// Returns why a text is no id, if it is the error of a formula.
pub(super) fn id_error(id: &str) -> Option<String> {
    let error = formula_error(id)?;
    Some(format!(
        "the id {error} is the error of a formula; correct it in the spreadsheet program"
    ))
}

/// Returns why the cell of a column is refused, if it is the error of a formula.
pub fn cell_error(column: &str, cell: &str) -> Option<String> {
    let error = formula_error(cell)?;
    Some(format!(
        "column {column} has the error {error} of a formula; correct it in the spreadsheet program, or clear the cell"
    ))
}

/// Values of other columns that are errors of formulas. They are left out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FormulaErrors {
    count: usize,
    /// The first one, its column and its line, as a message shows them.
    first: String,
}

impl FormulaErrors {
    /// Removes such values from the other columns of a row on a line.
    pub(super) fn leave_out(&mut self, line: usize, meta: &mut BTreeMap<String, Value>) {
        meta.retain(|column, value| {
            let Some(error) = value.as_str().and_then(formula_error) else {
                return true;
            };
            if self.count == 0 {
                let column = shown_column(column);
                self.first = format!("{error} in column {column} on line {line}");
            }
            self.count += 1;
            false
        });
    }

    /// Returns a warning, if there are any.
    pub fn warning(&self) -> Option<String> {
        let Self { count, first } = self;
        match count {
            0 => None,
            1 => Some(format!(
                "an error of a formula is left out, {first}; correct it in the spreadsheet program, and import again"
            )),
            _ => Some(format!(
                "{count} errors of formulas are left out, the first {first}; correct them in the spreadsheet program, and import again"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{parse_blocks, parse_csv, parse_jsonl, read_blocks, read_csv};

    #[test]
    fn errors_of_formulas_are_no_ids() {
        for error in ["#REF!", "#N/A", "#NAME?", "#ERROR!", "#n/a"] {
            let upper = error.to_uppercase();
            let why = format!("the id {upper} is the error of a formula");
            let csv = format!("id,mesh,print\na,m,p\n{error},m,p\n");
            let refused = parse_csv(csv.as_bytes()).expect_err("an error").to_string();
            assert!(refused.starts_with(&format!("line 3: {why}")), "{refused}");
            let json = format!("{{\"id\":\"{error}\",\"mesh\":\"m\",\"print\":\"p\"}}");
            let refused = parse_jsonl(json.as_bytes()).expect_err("an error");
            assert!(refused.to_string().contains(&why), "{refused}");
            let blocks = format!("block,mesh,page\n{error},m,p\n");
            let refused = parse_blocks(blocks.as_bytes()).expect_err("an error");
            assert!(refused.to_string().contains(&why), "{refused}");
        }
        let other = parse_csv(b"id,mesh,print\n#12,m,p\n").expect("a list");
        assert_eq!(other[0].name.as_str(), "#12");
    }

    #[test]
    fn errors_of_formulas_are_refused_in_known_columns() {
        for (column, error) in [
            ("mesh", "#REF!"),
            ("print", "#N/A"),
            ("character", "#VALUE!"),
            ("block", "#n/a"),
            ("unit", "Err:502"),
            ("scanned_face_down", "#NAME?"),
        ] {
            let cells = ["mesh", "print"].map(|name| if name == column { error } else { "a" });
            let mut list = format!("id,mesh,print\nx,{}\n", cells.join(","));
            if !["mesh", "print"].contains(&column) {
                list = format!("id,mesh,print,{column}\nx,m,p,{error}\n");
            }
            let refused = parse_csv(list.as_bytes()).expect_err(column).to_string();
            let shown = error.replace("#n/a", "#N/A");
            assert_eq!(
                refused,
                format!(
                    "line 2: column {column} has the error {shown} of a formula; correct it in the spreadsheet program, or clear the cell"
                )
            );
        }
        let blocks = "block,mesh,page,labels,side\nb,m,#REF!,#N/A,#N/A\n";
        let refused = parse_blocks(blocks.as_bytes()).expect_err("errors");
        let refused = refused.to_string();
        let lines: Vec<&str> = refused.lines().collect();
        assert_eq!(lines.len(), 3, "{refused}");
        for (line, column) in lines.iter().zip(["labels", "page", "side"]) {
            let start = format!("line 2: column {column} has the error #");
            assert!(line.starts_with(&start), "{refused}");
        }
        parse_csv(b"id,mesh,print,block\nErr:5,m,p,#1\n").expect("no errors");
    }

    #[test]
    fn errors_of_formulas_are_left_out_of_other_columns_with_a_warning() {
        let list = "id,mesh,print,folio,Năm\na,m,p,3,#N/A\nb,m,p,#REF!,1872\n";
        let mut rows = Vec::new();
        let read = read_csv(list.as_bytes(), &mut |row| rows.push(row)).expect("a list");
        let metadata: Vec<usize> = rows.iter().map(|row| row.meta.len()).collect();
        assert_eq!(metadata, [1, 1]);
        assert_eq!(
            read.formula_errors.warning().as_deref(),
            Some(
                "2 errors of formulas are left out, the first #N/A in column \"Năm\" on line 2; correct them in the spreadsheet program, and import again"
            )
        );
        let read = read_blocks(b"block,mesh,page,year\nb,m,p,#DIV/0!\n").expect("a list");
        assert_eq!(
            read.warnings,
            [
                "an error of a formula is left out, #DIV/0! in column \"year\" on line 2; correct it in the spreadsheet program, and import again"
            ]
        );
        assert!(read.rows[0].meta.is_empty());
        let none = read_csv(b"id,mesh,print,x\na,m,p,#12\n", &mut drop).expect("a list");
        assert_eq!(none.formula_errors.warning(), None);
    }
}

//! Errors of formulas, which spreadsheet programs write to CSV as text.

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

/// Returns why a text is no id, if it is the error of a formula.
pub(super) fn formula_error(id: &str) -> Option<String> {
    let error = ERRORS.iter().find(|error| error.eq_ignore_ascii_case(id))?;
    Some(format!(
        "the id {error} is the error of a formula; correct it in the spreadsheet program"
    ))
}

#[cfg(test)]
mod tests {
    use super::super::{parse_blocks, parse_csv, parse_jsonl};

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
}

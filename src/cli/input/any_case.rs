//! Words of options in upper or lower case.

use std::str::FromStr;

/// Parses one of a few words. Upper and lower case are equal.
pub(crate) fn any_case<T: FromStr<Err = String>>(text: &str) -> Result<T, String> {
    // The message has the word as it was typed.
    text.to_lowercase()
        .parse()
        .or_else(|_: String| text.parse())
}

#[cfg(test)]
mod tests {
    use super::any_case;
    use mocban_core::domain::BlockSide;

    #[test]
    fn case_makes_no_difference_and_messages_have_what_was_typed() {
        assert_eq!(any_case("Back"), Ok(BlockSide::Back));
        let refused = any_case::<BlockSide>("Top").expect_err("not a side");
        assert!(refused.starts_with("\"Top\" is not a side"), "{refused}");
    }
}

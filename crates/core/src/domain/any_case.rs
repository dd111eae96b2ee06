//! Names that people type in upper or lower case.

use std::str::FromStr;

/// Parses one of a few names. Upper and lower case are equal, and blanks around the name are left out. The error shows the
/// name as it was typed.
pub fn any_case<T: FromStr>(text: &str) -> Result<T, T::Err> {
    let plain = text.trim().to_lowercase();
    plain.parse().or_else(|_: T::Err| text.parse())
}

#[cfg(test)]
mod tests {
    use super::any_case;
    use crate::domain::BlockSide;

    #[test]
    fn case_makes_no_difference_and_messages_have_what_was_typed() {
        assert_eq!(any_case::<BlockSide>(" Back"), Ok(BlockSide::Back));
        let refused = any_case::<BlockSide>("Top").expect_err("not a side");
        assert!(refused.starts_with("\"Top\" is not a side"), "{refused}");
    }
}

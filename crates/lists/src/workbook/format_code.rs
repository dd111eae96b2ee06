//! The parts of the code of a format, such as `[Red]"B"000;@`.

/// Longest code of a format that Excel has, in characters.
pub(super) const MAX_CODE_CHARS: usize = 255;

/// The value of the cell as it is, in a code.
pub(super) const GENERAL: &str = "General";

/// A part of a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CodeToken<'c> {
    /// Text that is shown: in quotation marks or behind a backslash.
    Text(&'c str),
    /// What stands in brackets: a colour, a condition or a currency.
    Brackets(&'c str),
    /// Blank room as wide as a character, or filled with it: an underscore or an asterisk and the character.
    Room,
    /// Another character.
    Character(char),
}

/// Takes the first part off a code. Returns `None` at its end.
pub(super) fn take_token<'c>(code: &mut &'c str) -> Option<CodeToken<'c>> {
    let whole = *code;
    let first = whole.chars().next()?;
    let rest = &whole[first.len_utf8()..];
    let (token, rest) = match first {
        '"' => {
            let (text, rest) = rest.split_once('"').unwrap_or((rest, ""));
            (CodeToken::Text(text), rest)
        }
        '[' => {
            let (inner, rest) = rest.split_once(']').unwrap_or((rest, ""));
            (CodeToken::Brackets(inner), rest)
        }
        '\\' | '_' | '*' => {
            let (next, rest) = rest.split_at(rest.chars().next().map_or(0, char::len_utf8));
            let token = match first {
                '\\' => CodeToken::Text(next),
                _ => CodeToken::Room,
            };
            (token, rest)
        }
        other => (CodeToken::Character(other), rest),
    };
    *code = rest;
    Some(token)
}

#[cfg(test)]
mod tests {
    use super::CodeToken::{Brackets, Character, Room, Text};
    use super::take_token;

    #[test]
    fn quotes_brackets_and_escapes_are_one_part_each() {
        let mut code = "[Red]\"B;\"0\\ố_)*-;@\\";
        let parts: Vec<_> = std::iter::from_fn(|| take_token(&mut code)).collect();
        let expected = [
            Brackets("Red"),
            Text("B;"),
            Character('0'),
            Text("ố"),
            Room,
            Room,
            Character(';'),
            Character('@'),
            Text(""),
        ];
        assert_eq!(parts, expected);
        for (mut open, expected) in [("\"a", Text("a")), ("[a", Brackets("a")), ("_", Room)] {
            assert_eq!(take_token(&mut open), Some(expected));
            assert_eq!(take_token(&mut open), None);
        }
    }
}

//! Parser of decimal numbers, which is faster than the standard library for short ones.

/// Digits that fit a 64-bit mantissa without overflow.
const MAX_DIGITS: usize = 19;
/// Mantissas below this are exact as a 64-bit float.
const EXACT_BELOW: u64 = 1 << 53;
/// Powers of ten that 64-bit floats represent exactly. The product or quotient of an exact mantissa and an exact power is
/// rounded only once, so it is the float nearest to the decimal number (Clinger 1990, doi:10.1145/93542.93557).
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Parses a decimal number that a text begins with, and returns it with the rest of the text. Returns `None` if the text
/// begins with another word than digits with at most one point, a minus sign and an exponent.
#[inline(always)]
pub(super) fn parse(text: &[u8]) -> Option<(f64, &[u8])> {
    let is_negative = text.first() == Some(&b'-');
    let mut rest = &text[usize::from(is_negative)..];
    let mut mantissa = 0;
    let mut digits = read_digits(rest, &mut mantissa);
    rest = &rest[digits..];
    let mut places = 0;
    if let [b'.', fraction @ ..] = rest {
        places = read_many_digits(fraction, &mut mantissa);
        digits += places;
        rest = &fraction[places..];
    }
    if digits == 0 {
        return None;
    }
    let mut power = -(places as i64);
    if let [b'e' | b'E', exponent @ ..] = rest {
        let value;
        (value, rest) = parse_exponent(exponent)?;
        power = power.saturating_add(value);
    }
    let is_exact = digits <= MAX_DIGITS && mantissa < EXACT_BELOW;
    let scale = POWERS_OF_TEN.get(power.unsigned_abs() as usize);
    let Some(scale) = scale.filter(|_| is_exact) else {
        return parse_slowly(text, rest);
    };
    let mantissa = mantissa as f64;
    let value = if power < 0 {
        mantissa / scale
    } else {
        mantissa * scale
    };
    Some((if is_negative { -value } else { value }, rest))
}

/// Parses the exponent that a text begins with, and returns it with the rest of the text. An exponent of ten or more digits
/// is returned as the largest integer, whatever its sign: no power of ten in the table has it.
fn parse_exponent(text: &[u8]) -> Option<(i64, &[u8])> {
    let sign = usize::from(matches!(text.first(), Some(b'-' | b'+')));
    let mut value = 0;
    let digits = read_digits(&text[sign..], &mut value);
    let value = match digits {
        0 => return None,
        1..=9 if text[0] == b'-' => -(value as i64),
        1..=9 => value as i64,
        _ => i64::MAX,
    };
    Some((value, &text[sign + digits..]))
}

/// Parses the text before `rest`, which is a later part of it, by the standard library.
#[cold]
fn parse_slowly<'a>(text: &[u8], rest: &'a [u8]) -> Option<(f64, &'a [u8])> {
    let number = std::str::from_utf8(&text[..text.len() - rest.len()]);
    Some((number.ok()?.parse().ok()?, rest))
}

/// Reads decimal digits, appends them to `number` and returns their count. On overflow, `number` wraps around.
#[inline]
pub(super) fn read_digits(text: &[u8], number: &mut u64) -> usize {
    let mut count = 0;
    for digit in text.iter().map(|byte| byte.wrapping_sub(b'0')) {
        if digit > 9 {
            break;
        }
        *number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
        count += 1;
    }
    count
}

/// Reads decimal digits like [`read_digits`], in groups of eight while at least eight follow. For long numbers, this is
/// faster.
#[inline]
fn read_many_digits(text: &[u8], number: &mut u64) -> usize {
    let mut count = 0;
    while let Some(eight) = text[count..].first_chunk()
        && let Some(value) = eight_digits(*eight)
    {
        *number = number.wrapping_mul(100_000_000).wrapping_add(value);
        count += 8;
    }
    count + read_digits(&text[count..], number)
}

/// Returns the number that eight digits are; `None` if one is another character. Combines digits to pairs, pairs to
/// fours, and fours to eight, each within one word of 64 bits.
#[inline]
fn eight_digits(text: [u8; 8]) -> Option<u64> {
    let word = u64::from_le_bytes(text);
    let digits = word.wrapping_sub(0x3030_3030_3030_3030);
    // A byte that is no digit has one of its four upper bits, or gets one if 6 is added: above '9' it is at least 10, and
    // below '0' the subtraction wraps around.
    let others = digits | digits.wrapping_add(0x0606_0606_0606_0606);
    if others & 0xf0f0_f0f0_f0f0_f0f0 != 0 {
        return None;
    }
    let pairs = digits.wrapping_mul(1 + (10 << 8)) >> 8 & 0x00ff_00ff_00ff_00ff;
    let fours = pairs.wrapping_mul(1 + (100 << 16)) >> 16 & 0x0000_ffff_0000_ffff;
    Some(fours.wrapping_mul(1 + (10_000 << 32)) >> 32)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::parse;

    /// Asserts that a text is read as the standard library reads it, up to what follows the number.
    fn assert_is_read(number: &str) {
        let wanted: f64 = number.parse().expect(number);
        for end in ["", " 7", "\n1.5e3", ",0", "x"] {
            let text = format!("{number}{end}");
            let (value, rest) = parse(text.as_bytes()).expect(&text);
            assert_eq!(value.to_bits(), wanted.to_bits(), "{text}");
            assert_eq!(rest, end.as_bytes(), "{text}");
        }
    }

    #[test]
    fn numbers_at_limits_are_read_like_those_of_the_standard_library() {
        for number in [
            "0",
            "-0",
            "-0.0",
            "7.",
            ".5",
            "-.5",
            "9007199254740991",
            "9007199254740992",
            "9007199254740993",
            "0.1",
            "0.3",
            "12345678",
            "1.12345678",
            "1.1234567812345678",
            "1.123456781234567812345678",
            "00000000000000000000001.5",
            "1e0",
            "1E22",
            "1e-22",
            "1e23",
            "1e-23",
            "4.9e-324",
            "2e-324",
            "1.8e308",
            "-1e999999999999999999999",
            "1e-99999999999999999999999",
            "1.5e+00000000003",
            "123456789012345678901234567890",
            "179769313486231580793728971405303415079934132710037826936173778980444968292764",
        ] {
            assert_is_read(number);
        }
    }

    #[test]
    fn other_words_are_not_numbers() {
        for text in [
            "", "-", ".", "-.", "e5", "1e", "1e+", "1e-x", "+1", "nan", "inf", "/7", ":7", "x",
            "\u{660}1", "--1",
        ] {
            assert_eq!(parse(text.as_bytes()), None, "{text}");
        }
        // Bytes beside the digits, after eight digits and within them.
        for text in [
            "1.1234567/",
            "1.1234567:",
            "1.12345678/9",
            "1.1234\u{ff}567",
        ] {
            let end = text[2..].find(|c: char| !c.is_ascii_digit()).expect(text) + 2;
            let (value, rest) = parse(text.as_bytes()).expect(text);
            assert_eq!(Some(value), text[..end].parse().ok(), "{text}");
            assert_eq!(rest, &text.as_bytes()[end..], "{text}");
        }
    }

    proptest! {
        #[test]
        fn any_number_is_read_like_those_of_the_standard_library(
            number in "-?[0-9]{1,22}(\\.[0-9]{0,30})?([eE][-+]?[0-9]{1,3})?"
        ) {
            assert_is_read(&number);
        }

        #[test]
        fn floats_as_printed_are_read_back(value in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL) {
            assert_is_read(&format!("{value:e}"));
            assert_is_read(&format!("{value:.17e}"));
            assert_is_read(&format!("{value}"));
        }
    }
}

//! The likely encoding of a list that is not UTF-8.

/// Bytes of the combining tone marks of Windows-1258.
const VIETNAMESE_TONES: [u8; 5] = [0xcc, 0xd2, 0xde, 0xec, 0xf2];
/// Bytes of Đ, Ơ and Ư and their small letters in Windows-1258. In Windows-1252 they are Ð, Õ and Ý.
const VIETNAMESE_LETTERS: [u8; 6] = [0xd0, 0xf0, 0xd5, 0xf5, 0xdd, 0xfd];

/// Returns what to do about a list that is not UTF-8, with its likely encoding: GB 18030, or Windows-1258 or Windows-1252,
/// in which spreadsheet programs save CSV files in Vietnam and in western countries. Only lines that are not UTF-8 are considered.
/// Returns nothing if one of them is not text.
pub(super) fn encoding_hint(list: &[u8]) -> String {
    let lines = list.split(|byte| *byte == b'\n');
    let lines: Vec<&[u8]> = lines
        .filter(|line| std::str::from_utf8(line).is_err())
        .collect();
    let is_text = |byte: &u8| *byte >= 0x20 || byte.is_ascii_whitespace();
    // In all of them, lists mix ASCII letters with bytes above ASCII.
    let is_words =
        |line: &&[u8]| line.iter().all(is_text) && line.iter().any(u8::is_ascii_alphabetic);
    if !lines.iter().all(is_words) {
        return String::new();
    }
    let is_vowel = |byte: u8| b"aeiouyAEIOUY".contains(&byte) || byte >= 0xc0;
    let has_tone = |line: &[u8]| {
        let mut pairs = line.windows(2);
        pairs.any(|pair| is_vowel(pair[0]) && VIETNAMESE_TONES.contains(&pair[1]))
    };
    let has_letter = |line: &[u8]| line.iter().any(|byte| VIETNAMESE_LETTERS.contains(byte));
    let name = if lines.iter().all(|line| is_chinese(line)) {
        "GB 18030 (Chinese)"
    } else if lines.iter().any(|line| has_tone(line) || has_letter(line)) {
        "Windows-1258 (Vietnamese)"
    } else {
        "Windows-1252 (Western European)"
    };
    format!("; it seems to be {name}: save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")")
}

/// Returns whether all bytes of a line above ASCII are characters of GB 2312, two bytes each, and no letter stands beside
/// them. Vietnamese words mix such bytes with ASCII letters.
fn is_chinese(line: &[u8]) -> bool {
    let mut words = line.split(|byte| byte.is_ascii() && !byte.is_ascii_alphabetic());
    words.all(|word| {
        let (pairs, rest) = word.as_chunks::<2>();
        let is_character = |pair: &[u8; 2]| matches!(pair, [0xb0..=0xf7, 0xa1..=0xfe]);
        word.is_ascii() || (rest.is_empty() && pairs.iter().all(is_character))
    })
}

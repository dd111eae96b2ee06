//! The likely encoding of a list that is not UTF-8.

/// Bytes of the combining tone marks of Windows-1258.
const VIETNAMESE_TONES: [u8; 5] = [0xcc, 0xd2, 0xde, 0xec, 0xf2];
/// Bytes of Đ, Ơ and Ư and their small letters in Windows-1258. In Windows-1252 they are Ð, Õ and Ý.
const VIETNAMESE_LETTERS: [u8; 6] = [0xd0, 0xf0, 0xd5, 0xf5, 0xdd, 0xfd];

/// Bytes of small letters of TCVN3 that are signs in Windows-1252 and 1258. Signs that stand behind words there, such as the
/// registered sign, are left out.
const TCVN3_SIGNS: [u8; 13] = [
    0xa8, 0xaa, 0xab, 0xac, 0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xbb, 0xbc, 0xbd, 0xbe,
];
/// Bytes above 0xa0 that are no letters in TCVN3.
const NOT_TCVN3: [u8; 19] = [
    0xaf, 0xb0, 0xb1, 0xb2, 0xb3, 0xb4, 0xba, 0xbf, 0xc0, 0xc1, 0xc2, 0xc3, 0xc4, 0xc5, 0xcd, 0xd9,
    0xda, 0xdb, 0xff,
];

/// Returns what to do about a list that is not UTF-8, with its likely encoding: a two-byte encoding of Chinese or Japanese, TCVN3,
/// which older Vietnamese fonts use, or Windows-1258 or Windows-1252, in which spreadsheet programs save CSV files in Vietnam and
/// in western countries. Only lines that are not UTF-8 are considered. Returns nothing if one of them is not text or has no
/// ASCII letters.
pub(super) fn encoding_hint(list: &[u8]) -> String {
    let lines = list.split(|byte| *byte == b'\n');
    let lines: Vec<&[u8]> = lines
        .filter(|line| std::str::from_utf8(line).is_err())
        .collect();
    let is_text = |byte: &u8| *byte >= 0x20 || byte.is_ascii_whitespace();
    // In all of these encodings, lists mix ASCII letters with bytes above ASCII.
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
    } else if let Some(name) = two_byte_encoding(&lines) {
        name
    } else if is_tcvn3(&lines) {
        return "; it seems to be TCVN3 (Vietnamese): convert the list to UTF-8, such as with UniKey"
            .to_owned();
    } else if lines.iter().any(|line| has_tone(line) || has_letter(line)) {
        "Windows-1258 (Vietnamese)"
    } else {
        "Windows-1252 (Western European)"
    };
    format!("; it seems to be {name}: save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")")
}

/// Returns the name of the two-byte encoding in which all lines are text, if there is one.
fn two_byte_encoding(lines: &[&[u8]]) -> Option<&'static str> {
    let pairs: Vec<[u8; 2]> = (lines.iter())
        .map(|line| two_byte_characters(line))
        .collect::<Option<Vec<_>>>()?
        .concat();
    let are = |lead: fn(u8) -> bool, second: fn(u8) -> bool| {
        pairs.iter().all(|pair| lead(pair[0]) && second(pair[1]))
    };
    let is_low = |byte: u8| (0x40..=0x7e).contains(&byte);
    if are(
        |lead| matches!(lead, 0x81..=0x9f | 0xe0..=0xfc),
        |second| matches!(second, 0x40..=0x7e | 0x80..=0xfc),
    ) && pairs.iter().any(|pair| pair[0] <= 0x9f)
    {
        Some("Shift-JIS (Japanese)")
    } else if are(
        |lead| matches!(lead, 0xa1..=0xf9),
        |second| matches!(second, 0x40..=0x7e | 0xa1..=0xfe),
    ) && pairs.iter().any(|pair| is_low(pair[1]))
    {
        Some("Big5 (Chinese)")
    } else if pairs
        .iter()
        .any(|pair| pair[0] <= 0xa0 || (0x80..=0xa0).contains(&pair[1]))
    {
        Some("GB 18030 (Chinese)")
    } else {
        None
    }
}

/// Returns the two-byte characters of a line. Returns `None` if no two of them follow each other, if a byte above ASCII has no
/// second one, or if an ASCII letter stands beside a character, as in words of other languages.
fn two_byte_characters(line: &[u8]) -> Option<Vec<[u8; 2]>> {
    let mut found = Vec::new();
    let (mut at, mut longest, mut run) = (0, 0, 0);
    while at < line.len() {
        let byte = line[at];
        if byte.is_ascii() {
            let is_beside = run > 0 || line.get(at + 1).is_some_and(|next| !next.is_ascii());
            if is_beside && byte.is_ascii_alphabetic() {
                return None;
            }
            run = 0;
            at += 1;
        } else {
            let second = *line.get(at + 1).filter(|second| **second >= 0x40)?;
            found.push([byte, second]);
            run += 1;
            longest = longest.max(run);
            at += 2;
        }
    }
    (longest >= 2).then_some(found)
}

/// Returns whether all bytes above ASCII are letters of TCVN3, and one behind an ASCII letter is a sign in other encodings.
fn is_tcvn3(lines: &[&[u8]]) -> bool {
    let is_used = |byte: &u8| byte.is_ascii() || *byte > 0xa0 && !NOT_TCVN3.contains(byte);
    let has_sign = |line: &&[u8]| {
        let mut pairs = line.windows(2);
        pairs.any(|pair| pair[0].is_ascii_alphabetic() && TCVN3_SIGNS.contains(&pair[1]))
    };
    lines.iter().all(|line| line.iter().all(is_used)) && lines.iter().any(has_sign)
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

#[cfg(test)]
mod tests {
    use super::encoding_hint;

    #[test]
    fn encodings_are_named() {
        let texts: [(&[u8], &str); 6] = [
            // "id,tên chữ" and "a,bản khắc gỗ" in TCVN3.
            (
                b"id,t\xaan ch\xf7\na,b\xb6n kh\xbec g\xe7\n",
                "TCVN3 (Vietnamese)",
            ),
            // Signs and letters of Western texts.
            (
                b"id,note\na,caf\xe9 \xa9 2026, 5 \xb5m, Photoshop\xae\n",
                "Windows-1252 (Western European)",
            ),
            (
                b"id,note\na,\xc5l\nb,K\xe4se\n",
                "Windows-1252 (Western European)",
            ),
            // "a,台灣木刻" in Big5.
            (b"id,note\na,\xa5x\xc6W\xa4\xec\xa8\xe8\n", "Big5 (Chinese)"),
            // "a,版木の文字" in Shift-JIS.
            (
                b"id,note\na,\x94\xc5\x96\xd8\x82\xcc\x95\xb6\x8e\x9a\n",
                "Shift-JIS (Japanese)",
            ),
            // "a,木刻喃字" in GB 18030.
            (
                b"id,note\na,\xc4\xbe\xbf\xcc\xe0\xab\xd7\xd6\n",
                "GB 18030 (Chinese)",
            ),
        ];
        for (bytes, name) in texts {
            let hint = encoding_hint(bytes);
            let start = format!("; it seems to be {name}: ");
            assert!(hint.starts_with(&start), "{name}: {hint}");
        }
    }
}

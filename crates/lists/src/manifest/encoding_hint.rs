//! The likely encoding of a list that is not UTF-8.

use std::collections::BTreeSet;

/// Bytes of the combining tone marks of Windows-1258.
const VIETNAMESE_TONES: [u8; 5] = [0xcc, 0xd2, 0xde, 0xec, 0xf2];
/// Bytes of Đ, Ơ and Ư and their small letters in Windows-1258. In Windows-1252 they are Ð, Õ and Ý.
const VIETNAMESE_LETTERS: [u8; 6] = [0xd0, 0xf0, 0xd5, 0xf5, 0xdd, 0xfd];

/// Bytes of ă, â, ê, ô and ơ in TCVN3.
const TCVN3_VOWELS: [u8; 5] = [0xa8, 0xa9, 0xaa, 0xab, 0xac];
/// Bytes above 0xa0 that are no letters in TCVN3.
const NOT_TCVN3: [u8; 19] = [
    0xaf, 0xb0, 0xb1, 0xb2, 0xb3, 0xb4, 0xba, 0xbf, 0xc0, 0xc1, 0xc2, 0xc3, 0xc4, 0xc5, 0xcd, 0xd9,
    0xda, 0xdb, 0xff,
];

/// What to do about a list that is not UTF-8.
const SAVE: &str = "save the list as UTF-8 (in Excel: Save As, \"CSV UTF-8\")";

/// Returns what to do about a list that is not UTF-8, with the name of its encoding if the bytes fit no other that is usual:
/// Shift-JIS, EUC-JP or Big5, TCVN3, which older Vietnamese fonts use, or Windows-1258 or Windows-1252, in which spreadsheet
/// programs save CSV files in Vietnam and in western countries. Other encodings of Chinese, Japanese and Korean share their
/// bytes. Only lines that are not UTF-8 are considered. Returns nothing if one of them is not text.
pub(super) fn encoding_hint(list: &[u8]) -> String {
    let lines = list.split(|byte| *byte == b'\n');
    let lines: Vec<&[u8]> = lines
        .filter(|line| std::str::from_utf8(line).is_err())
        .collect();
    let is_text = |byte: &u8| *byte >= 0x20 || byte.is_ascii_whitespace();
    if !lines.iter().all(|line| line.iter().all(is_text)) {
        return String::new();
    }
    // In all of these encodings, lists mix ASCII letters with bytes above ASCII.
    let has_ascii = |line: &&[u8]| line.iter().any(u8::is_ascii_alphabetic);
    let name = if !lines.iter().all(has_ascii) {
        None
    } else if let Some(name) = two_byte_encoding(&lines) {
        Some(name)
    } else if is_tcvn3(&lines) {
        return "; it seems to be TCVN3 (Vietnamese): convert the list to UTF-8, such as with UniKey"
            .to_owned();
    } else if is_vietnamese(&lines) {
        Some("Windows-1258 (Vietnamese)")
    } else {
        is_western(&lines).then_some("Windows-1252 (Western European)")
    };
    match name {
        Some(name) => format!("; it seems to be {name}: {SAVE}"),
        None => format!("; {SAVE}"),
    }
}

/// Bytes of all letters of Vietnamese in Windows-1258, and of its tone marks.
const VIETNAMESE: [u8; 46] = [
    0xc0, 0xc1, 0xc2, 0xc3, 0xc8, 0xc9, 0xca, 0xcc, 0xcd, 0xd0, 0xd2, 0xd3, 0xd4, 0xd5, 0xd9, 0xda,
    0xdd, 0xde, 0xe0, 0xe1, 0xe2, 0xe3, 0xe8, 0xe9, 0xea, 0xec, 0xed, 0xf0, 0xf2, 0xf3, 0xf4, 0xf5,
    0xf9, 0xfa, 0xfd, 0x91, 0x92, 0x93, 0x94, 0x96, 0x97, 0xa0, 0xab, 0xbb, 0xb0, 0xb7,
];

/// Returns whether lines are Vietnamese in Windows-1258: they have only its bytes, and behind vowels two different tone marks,
/// or one beside a letter with a hook or a bar. Words of other languages may have a single one by chance.
fn is_vietnamese(lines: &[&[u8]]) -> bool {
    let is_used = |byte: &u8| byte.is_ascii() || VIETNAMESE.contains(byte);
    if !lines.iter().all(|line| line.iter().all(is_used)) {
        return false;
    }
    // In capitals, the tilde is a Turkish letter.
    let is_vowel = |byte: u8, mark: u8| {
        let is_small = b"aeiouy".contains(&byte) || byte >= 0xe0;
        is_small || mark != 0xde && (b"AEIOUY".contains(&byte) || byte >= 0xc0)
    };
    let pairs = lines.iter().flat_map(|line| line.windows(2));
    let tones =
        pairs.filter(|pair| VIETNAMESE_TONES.contains(&pair[1]) && is_vowel(pair[0], pair[1]));
    let tones: BTreeSet<u8> = tones.map(|pair| pair[1]).collect();
    let bytes = lines.iter().copied().flatten();
    let letters: BTreeSet<&u8> = bytes
        .filter(|byte| VIETNAMESE_LETTERS.contains(byte))
        .collect();
    !tones.is_empty() && tones.len() + letters.len() > 1
}

/// Letters that Windows-1252 shares with the encodings of other countries, or that have rare letters there.
const WESTERN_LETTERS: [u8; 34] = [
    0xc0, 0xc1, 0xc2, 0xc4, 0xc5, 0xc7, 0xc9, 0xcb, 0xcd, 0xce, 0xd3, 0xd4, 0xd6, 0xda, 0xdc, 0xdf,
    0xe0, 0xe1, 0xe2, 0xe4, 0xe5, 0xe7, 0xe9, 0xeb, 0xed, 0xee, 0xf3, 0xf4, 0xf6, 0xfa, 0xfc, 0xd7,
    0xf7, 0xc6,
];
/// Signs of Windows-1252 that follow words, and signs that precede words.
const CLOSING_SIGNS: [u8; 11] = [
    0x85, 0x94, 0x99, 0xa0, 0xa9, 0xae, 0xb0, 0xb7, 0xbb, 0xb2, 0xb3,
];
const OPENING_SIGNS: [u8; 6] = [0x80, 0x91, 0x93, 0xa7, 0xab, 0xb5];

/// Returns whether lines are text in Windows-1252, or have the same letters there as in the likely other encodings.
fn is_western(lines: &[&[u8]]) -> bool {
    let is_letter =
        |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphabetic() || *byte >= 0xc0);
    let is_usual = |line: &[u8], at: usize| {
        let (byte, next) = (line[at], line.get(at + 1));
        let before = at.checked_sub(1).map(|before| &line[before]);
        match byte {
            // Dashes and apostrophes.
            0x92 | 0x96 | 0x97 => true,
            // Vietnamese in VNI has a circumflex of its own behind vowels.
            0xe2 => !before.is_some_and(|before| b"aeo".contains(before)),
            _ if WESTERN_LETTERS.contains(&byte) => {
                // Words of other scripts have many such bytes together.
                !(before.is_some_and(|byte| *byte >= 0xc0)
                    && next.is_some_and(|byte| *byte >= 0xc0))
            }
            _ if CLOSING_SIGNS.contains(&byte) => !is_letter(next),
            _ => OPENING_SIGNS.contains(&byte) && !is_letter(before),
        }
    };
    let is_line = |line: &&[u8]| {
        let mut places = (0..line.len()).filter(|at| !line[*at].is_ascii());
        places.all(|at| is_usual(line, at))
    };
    lines.iter().all(is_line)
}

/// Fewest bytes of characters by which an encoding of two bytes each is recognized.
const FEWEST_BYTES: usize = 4;
/// Names encodings that share their bytes.
const EAST_ASIAN: &str = "an encoding of Chinese, Japanese or Korean, such as GB 18030 or EUC-KR";

/// Returns the name of the two-byte encoding in which all lines are text, if there is one.
fn two_byte_encoding(lines: &[&[u8]]) -> Option<&'static str> {
    let pairs = lines.iter().map(|line| two_byte_characters(line));
    let Some(pairs) = pairs.collect::<Option<Vec<_>>>() else {
        // Each line may have one character alone.
        let is_chinese = lines.iter().all(|line| is_chinese(line));
        return (is_chinese && is_east_asian(lines)).then_some(EAST_ASIAN);
    };
    let pairs = pairs.concat();
    let are = |lead: fn(u8) -> bool, second: fn(u8) -> bool| {
        pairs.iter().all(|pair| lead(pair[0]) && second(pair[1]))
    };
    let has = |pair: fn(&[u8; 2]) -> bool| pairs.iter().any(pair);
    if are(
        |lead| matches!(lead, 0x81..=0x9f | 0xe0..=0xfc),
        |second| matches!(second, 0x40..=0x7e | 0x80..=0xfc),
    ) && has(|pair| matches!(pair, [0x82, 0x9f..=0xf1] | [0x83, 0x40..=0x96]))
    {
        return Some("Shift-JIS (Japanese)");
    }
    let is_double = are(|lead| matches!(lead, 0xa1..=0xfe), |second| second >= 0xa1);
    if is_double && has(|pair| matches!(pair, [0xa4 | 0xa5, 0xa1..=0xf6])) {
        return Some("EUC-JP (Japanese)");
    }
    // The most frequent characters of Big5, which no other encoding has at these places.
    if are(
        |lead| matches!(lead, 0xa1..=0xf9),
        |second| matches!(second, 0x40..=0x7e | 0xa1..=0xfe),
    ) && has(|pair| matches!(pair, [0xa4..=0xa7, 0x40..=0x7e]))
    {
        return Some("Big5 (Chinese)");
    }
    let is_long = has(|pair| pair[0] <= 0xa0 || pair[1] <= 0xa0);
    ((is_double || is_long) && is_east_asian(lines)).then_some(EAST_ASIAN)
}

/// Returns whether lines have enough bytes above ASCII, and one that most texts of two-byte characters have but few letters of
/// Cyrillic or Greek.
fn is_east_asian(lines: &[&[u8]]) -> bool {
    let bytes = || {
        lines
            .iter()
            .copied()
            .flatten()
            .filter(|byte| !byte.is_ascii())
    };
    bytes().count() >= FEWEST_BYTES && bytes().any(|byte| matches!(byte, 0xb0..=0xbf))
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

/// Returns whether all bytes above ASCII are letters of TCVN3, and one between small ASCII letters is a vowel there and a sign or
/// a capital in other encodings.
fn is_tcvn3(lines: &[&[u8]]) -> bool {
    let is_used = |byte: &u8| byte.is_ascii() || *byte > 0xa0 && !NOT_TCVN3.contains(byte);
    let has_vowel = |line: &&[u8]| {
        let mut places = line.windows(3);
        places.any(|place| {
            place[0].is_ascii_lowercase()
                && TCVN3_VOWELS.contains(&place[1])
                && place[2].is_ascii_lowercase()
        })
    };
    lines.iter().all(|line| line.iter().all(is_used)) && lines.iter().any(has_vowel)
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
    use super::{EAST_ASIAN, SAVE, encoding_hint};

    #[test]
    fn encodings_are_named() {
        let texts: [(&[u8], &str); 8] = [
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
            (b"id,note\na,\xc4\xbe\xbf\xcc\xe0\xab\xd7\xd6\n", EAST_ASIAN),
            // "a,木版のもの" in EUC-JP.
            (
                b"id,note\na,\xcc\xda\xc8\xc7\xa4\xce\xa4\xe2\xa4\xce\n",
                "EUC-JP (Japanese)",
            ),
            // "a,목판" in EUC-KR.
            (b"id,note\na,\xb8\xf1\xc6\xc7\n", EAST_ASIAN),
        ];
        for (bytes, name) in texts {
            let hint = encoding_hint(bytes);
            let start = format!("; it seems to be {name}: ");
            assert!(hint.starts_with(&start), "{name}: {hint}");
        }
    }

    #[test]
    fn single_characters_of_several_lines_show_an_encoding_of_two_bytes() {
        // Two characters could also be Cyrillic letters.
        let list = |a: &[u8], b: &[u8]| [&b"1,a.stl,"[..], a, b"\n2,b.stl,", b, b"\n"].concat();
        let letters = list(b"\xc3\xf7", b"\xcf\xc2");
        assert_eq!(encoding_hint(&letters), format!("; {SAVE}"));
        let characters = list(b"\xd7\xd6", b"\xb5\xf1");
        let hint = encoding_hint(&characters);
        assert_eq!(hint, format!("; it seems to be {EAST_ASIAN}: {SAVE}"));
    }

    #[test]
    fn encodings_that_may_be_others_are_not_named() {
        for text in [
            // "a,доска" in Windows-1251.
            &b"id,note\na,\xe4\xee\xf1\xea\xe0\n"[..],
            // "a,česká kůže, něco" in ISO 8859-2, "b,pięć złotych", "c,širší".
            b"id,note\na,\xe8esk\xe1 k\xf9\xbee, n\xecco\n",
            b"id,note\nb,pi\xea\xe6 z\xb3otych\n",
            b"id,note\nc,\xb9ir\xb9\xed\n",
            // "a,kalıp ağır taş" in Windows-1254.
            b"id,note\na,kal\xfdp a\xf0\xfdr ta\xfe\n",
            // "a,perciò più così" in Windows-1252: the letters are others in ISO 8859-2.
            b"id,note\na,perci\xf2 pi\xf9 cos\xec\n",
            // "a,Nações" in Windows-1252.
            b"id,note\na,Na\xe7\xf5es\n",
            // "a,Holzstöcke" in Mac OS Roman and in the encoding of DOS.
            b"id,note\na,Holzst\x9acke\n",
            b"id,note\na,Holzst\x94cke\n",
            // "a,ξύλο" in Windows-1253.
            b"id,note\na,\xee\xfd\xeb\xef\n",
            // Without ASCII letters.
            b"1,\xe4\xee\xf1\n",
        ] {
            let shown = text.escape_ascii();
            assert_eq!(encoding_hint(text), format!("; {SAVE}"), "{shown}");
        }
    }
}

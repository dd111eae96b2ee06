//! Text that LaTeX shows unchanged.

use mocban_core::domain::{one_line, visible};

/// Longest word that must not be broken, characters.
const MAX_WORD: usize = 20;

/// Returns a sentence or caption. Long words, such as paths, may be broken after signs.
pub(super) fn sentence_text(text: &str) -> String {
    let text = one_line(text);
    let words = text.split(' ').map(|word| {
        if word.chars().count() <= MAX_WORD {
            return escape(word);
        }
        let parts = word.split_inclusive(['/', '\\', '_', '-', '.', ':']);
        let parts = parts.flat_map(chunks).map(|part| escape(&part));
        parts.collect::<Vec<_>>().join("\\allowbreak{}")
    });
    let words: Vec<String> = words.collect();
    words.join(" ").replace(" \\%", "\\,\\%")
}

/// Returns a word in chunks of at most [`MAX_WORD`] characters.
fn chunks(word: &str) -> Vec<String> {
    let letters: Vec<char> = word.chars().collect();
    letters
        .chunks(MAX_WORD)
        .map(|chunk| chunk.iter().collect())
        .collect()
}

/// Escapes text. Letters that fonts of pdfLaTeX lack are in `\mocbanchar`.
pub(super) fn escape(text: &str) -> String {
    // `visible` comes first, because the backslashes that it adds must be escaped too.
    let text = visible(text);
    let escaped: String = text.chars().map(escaped_char).collect();
    escaped.replace(" \\%", "\\,\\%")
}

fn escaped_char(c: char) -> String {
    match c {
        '&' | '%' | '$' | '#' | '_' | '{' | '}' => format!("\\{c}"),
        '\\' => "\\textbackslash{}".to_owned(),
        '~' => "\\textasciitilde{}".to_owned(),
        '^' => "\\textasciicircum{}".to_owned(),
        '<' => "\\textless{}".to_owned(),
        '>' => "\\textgreater{}".to_owned(),
        '"' => "\\textquotedbl{}".to_owned(),
        '\u{b0}' => "\\ensuremath{^\\circ}".to_owned(),
        '\u{2013}' => "--".to_owned(),
        '\u{201c}' => "``".to_owned(),
        '\u{201d}' => "''".to_owned(),
        '\n' | '\r' => " ".to_owned(),
        // The letters that the default fonts of pdfLaTeX have.
        '\u{20}'..='\u{7e}' | '\u{c0}'..='\u{17f}' => c.to_string(),
        _ => format!("\\mocbanchar{{{:04X}}}{{{c}}}", u32::from(c)),
    }
}

#[cfg(test)]
mod tests {
    use super::{escape, sentence_text};

    #[test]
    fn cells_cannot_hold_commands() {
        assert_eq!(
            escape(r"a_b & 5 % \x {y}"),
            r"a\_b \& 5\,\% \textbackslash{}x \{y\}"
        );
        assert_eq!(escape("in 5\u{b0}"), r"in 5\ensuremath{^\circ}");
        assert_eq!(escape("88.5\u{2013}99.1"), "88.5--99.1");
    }

    #[test]
    fn letters_without_a_font_have_their_code_point() {
        assert_eq!(escape("é 字"), r"é \mocbanchar{5B57}{字}");
        assert_eq!(escape("ễ𠀀"), r"\mocbanchar{1EC5}{ễ}\mocbanchar{20000}{𠀀}");
    }

    #[test]
    fn long_words_can_be_broken() {
        let text = sentence_text("in meshes/upright-0000.ply: 96.6 %");
        assert_eq!(
            text,
            r"in meshes/\allowbreak{}upright-\allowbreak{}0000.\allowbreak{}ply:\allowbreak{} 96.6\,\%"
                .replace(r":\allowbreak{} ", ": ")
        );
        let long = sentence_text(&"x".repeat(50));
        assert_eq!(long.matches("\\allowbreak").count(), 2);
    }
}

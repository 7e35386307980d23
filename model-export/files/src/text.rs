//! Texts of others, made such that they are seen and not obeyed.
//!
//! *in* names, cells and messages from files, models and arguments; *out* the same text where it is harmless, else with its
//! control and formatting characters written out as `\u{1b}`; *never* a character that moves a cursor, colours, rings, or turns
//! the direction of writing; *source* ECMA-48 (C0 and C1), Unicode TR 36 (bidirectional overrides), OWASP "CSV Injection".

use std::borrow::Cow;

/// Whether a character acts on a terminal or a page rather than being seen: controls (C0, DEL, C1), the separators of lines
/// and paragraphs, marks that turn the direction of writing, characters of no width, tags.
pub fn acts(character: char) -> bool {
    character.is_control()
        || matches!(character,
            '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}'
            | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

fn escaped(text: &str, harmless: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(|character| acts(character) && !harmless(character)) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if acts(character) && !harmless(character) {
            out.extend(character.escape_unicode());
        } else {
            out.push(character);
        }
    }
    Cow::Owned(out)
}

/// A text of one line: a name, a cell, a message. Line breaks and tabs are written out too, so that a name cannot add a line of
/// its own to a report.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, |_| false)
}

/// [`line()`] of a field in place.
pub fn mend(text: &mut String) {
    if let Cow::Owned(harmless) = line(text) {
        *text = harmless;
    }
}

/// A text of several lines that the program has laid out itself; the fields in it should have been made harmless by [`line()`].
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |character| character == '\n')
}

/// A JSON document: what acts stands in strings there, where `\u202e` is the same character to whoever parses it.
pub fn json(text: &str) -> Cow<'_, str> {
    let harmless = |character: char| matches!(character, '\n' | '\r' | '\t');
    if !text.chars().any(|character| acts(character) && !harmless(character)) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if acts(character) && !harmless(character) {
            let mut units = [0; 2];
            for unit in character.encode_utf16(&mut units) {
                out += &format!("\\u{unit:04x}");
            }
        } else {
            out.push(character);
        }
    }
    Cow::Owned(out)
}

/// A text cell of a CSV file. Spreadsheets take a cell that begins with `=`, `+`, `-`, `@` for a formula, also behind spaces and
/// in the wide form of these signs: such a cell begins with an apostrophe, which they show as text. Numbers are no text cells.
pub fn cell(text: &str) -> Cow<'_, str> {
    let harmless = line(text);
    let first = text.trim_start().chars().next();
    let formula =
        matches!(first, Some('=' | '+' | '-' | '@' | '＝' | '＋' | '－' | '＠')) || text.starts_with(['\t', '\r', '\n']);
    if formula { Cow::Owned(format!("'{harmless}")) } else { harmless }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_faked_verdict_is_seen_as_what_it_is() {
        assert_eq!(line("lab\u{1b}[2K\rSafe to fly"), "lab\\u{1b}[2K\\u{d}Safe to fly");
        assert_eq!(line("a\nSafe to fly"), "a\\u{a}Safe to fly");
        assert_eq!(line("\u{202e}ylf ot efaS"), "\\u{202e}ylf ot efaS");
        assert_eq!(lines("a\nb\u{9b}31m"), "a\nb\\u{9b}31m");
        for plain in ["crazyflie-brushless", "m/s²", "größer", "日本", "😀", "≥ 3 °"] {
            assert!(matches!(line(plain), Cow::Borrowed(same) if same == plain), "{plain}");
        }
    }

    #[test]
    fn formulae_become_text() {
        for (given, written) in [
            ("=HYPERLINK(\"http://x\")", "'=HYPERLINK(\"http://x\")"),
            ("+1", "'+1"),
            ("-1", "'-1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            (" =1", "' =1"),
            ("\t=1", "'\\u{9}=1"),
            ("\r=1", "'\\u{d}=1"),
            ("lab+20ms", "lab+20ms"),
            ("", ""),
        ] {
            assert_eq!(cell(given), written);
        }
    }

    proptest! {
        #[test]
        fn nothing_that_acts_is_left(
            text in any::<String>(),
            extra in "[\\x00-\\x1f\\x7f-\\x9f\\u{202a}-\\u{202e}\\u{2066}-\\u{2069}]{0,4}"
        ) {
            let text = format!("{text}{extra}{text}");
            prop_assert!(!line(&text).chars().any(acts));
            prop_assert!(!lines(&text).chars().any(|c| acts(c) && c != '\n'));
            let cell = cell(&text).into_owned();
            prop_assert!(!cell.chars().any(acts));
            prop_assert!(!cell.trim_start().starts_with(['=', '+', '-', '@']));
            let document = serde_json::to_string_pretty(&[&text]).unwrap();
            let shown = json(&document);
            prop_assert!(!shown.chars().any(|c| acts(c) && c != '\n'));
            prop_assert_eq!(serde_json::from_str::<Vec<String>>(&shown).unwrap(), [text]);
        }
    }
}

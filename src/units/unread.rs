//! A TOML file of a person that holds something else than it should: which line and key, what stands there, and what was expected.
//!
//! The parser speaks of types (`invalid type: string "8", expected f64`), a person is told of values: `line 31: tip.radius_mm is the text "8";
//! expected a number`. What it says of anything else is kept.

use toml::de::Error;

/// What is wrong with `text`, which reading it has ended with.
pub fn unread_toml(text: &str, error: &Error) -> String {
    let begins = error.span().map_or(0, |span| span.start.min(text.len()));
    let line = 1 + text.bytes().take(begins).filter(|b| *b == b'\n').count();
    let Some(said) = told(error) else {
        // What is no TOML says little by itself: it is shown.
        let row = text.lines().nth(line - 1).unwrap_or_default().trim();
        return format!("line {line}: {}, in {row:?}", syntax(error));
    };
    // A key that the file itself lacks is missing nowhere in particular.
    if begins == 0 && said.ends_with(" is missing") { said } else { format!("line {line}: {said}") }
}

/// The same without the line.
pub fn unread_words(error: &Error) -> String {
    told(error).unwrap_or_else(|| syntax(error))
}

/// What the parser says of a text that is no TOML, or of a key that stands there twice.
fn syntax(error: &Error) -> String {
    error.message().trim_end().replace('\n', "; ")
}

/// What is wrong with a key or its value; none where the text is no TOML.
fn told(error: &Error) -> Option<String> {
    let (message, path) = (error.message().trim_end(), path(error));
    let under = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    let first_name = |rest: &str| rest.split('`').next().unwrap_or_default().to_owned();
    if let Some(rest) = message.strip_prefix("missing field `") {
        return Some(format!("{} is missing", under(&first_name(rest))));
    }
    let (found, expected) = message.rsplit_once(", expected ").unwrap_or((message, ""));
    if let Some(rest) = found.strip_prefix("unknown field `") {
        let known = if expected.is_empty() { "no key".to_owned() } else { plain(expected) };
        return Some(format!("{} is not known; expected {known}", under(&first_name(rest))));
    }
    let found = if let Some(rest) = found.strip_prefix("unknown variant `") {
        Some(format!("the text {:?}", first_name(rest)))
    } else if let Some(length) = found.strip_prefix("invalid length ") {
        Some(format!("a list of {length}"))
    } else {
        found.strip_prefix("invalid type: ").or(found.strip_prefix("invalid value: ")).map(value)
    };
    match found {
        Some(found) if !path.is_empty() => Some(format!("{path} is {found}; expected {}", kind(expected))),
        Some(found) => Some(format!("{found}; expected {}", kind(expected))),
        None if path.is_empty() => None,
        None => Some(format!("{path}: {}", syntax(error))),
    }
}

/// The key, with the tables that it is in. The parser prints it, in a line of its own, of a text that it does not know.
fn path(error: &Error) -> String {
    let mut alone = error.clone();
    alone.set_input(None);
    let said = alone.to_string();
    let path = said.trim_end().rsplit_once("\nin `").and_then(|(_, path)| path.strip_suffix('`'));
    path.unwrap_or_default().to_owned()
}

/// A value as it is written.
fn value(found: &str) -> String {
    match found {
        // The parser hands a date on as it does a table.
        "map" => "a table or a date without quotes".to_owned(),
        "sequence" => "a list".to_owned(),
        _ => match found.split_once(' ') {
            Some(("string", text)) => format!("the text {text}"),
            _ => found.split('`').nth(1).unwrap_or(found).to_owned(),
        },
    }
}

/// What a type of the program is in a file.
fn kind(expected: &str) -> String {
    match expected {
        "f64" | "f32" => "a number",
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" | "usize" => "a whole number from 0 to 9223372036854775807",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a string" => "a text in quotes",
        "a boolean" => "true or false",
        "a sequence" => "a list",
        "a map" => "a table",
        _ if expected.starts_with("struct ") => "a table",
        _ => {
            let list = ["an array of length ", "a tuple of size "];
            let length = list.iter().find_map(|words| expected.strip_prefix(words));
            return length.map_or_else(|| plain(expected), |length| format!("a list of {length}"));
        }
    }
    .to_owned()
}

/// Without the quotes around names.
fn plain(words: &str) -> String {
    words.replace('`', "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only refused")]
    struct Keys {
        format: String,
        tip: Tip,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only refused")]
    struct Tip {
        radius_mm: f64,
        axis: [f64; 3],
        count: u32,
        shape: Shape,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Shape {
        Pad,
        Sphere,
    }

    const SOUND: &str =
        "format = \"x/1\"\n# é\n[tip]\nradius_mm = 8.0\naxis = [0, 0,\n1]\ncount = 3\nshape = \"pad\"\n";

    fn said(from: &str, to: &str) -> String {
        assert!(SOUND.contains(from));
        let text = SOUND.replacen(from, to, 1);
        unread_toml(&text, &toml::from_str::<Keys>(&text).expect_err(to))
    }

    #[test]
    fn a_value_of_a_wrong_kind_is_told_with_its_place_and_what_was_expected() {
        toml::from_str::<Keys>(SOUND).expect("sound");
        for (from, to, words) in [
            ("8.0", "\"8\"", "line 4: tip.radius_mm is the text \"8\"; expected a number"),
            ("8.0", "true", "line 4: tip.radius_mm is true; expected a number"),
            ("8.0", "[8.0]", "line 4: tip.radius_mm is a list; expected a number"),
            ("1]", "\"1\"]", "line 6: tip.axis is the text \"1\"; expected a number"),
            (
                "= [0, 0,\n1]",
                "= { x = 0 }",
                "line 5: tip.axis is a table or a date without quotes; expected a list of 3",
            ),
            (
                "8.0",
                "2026-11-02",
                "line 4: tip.radius_mm is a table or a date without quotes; expected a number",
            ),
            (
                "8.0",
                "\"a, expected b\"",
                "line 4: tip.radius_mm is the text \"a, expected b\"; expected a number",
            ),
            (
                "3",
                "5000000000",
                "line 7: tip.count is 5000000000; expected a whole number from 0 to 4294967295",
            ),
            (
                "3",
                "70000000000000000000",
                "line 7: tip.count is 70000000000000000000; expected a whole number from 0 to 4294967295",
            ),
            ("[0, 0,\n1]", "[0, 0]", "line 5: tip.axis is a list of 2; expected a list of 3"),
            ("3", "-3", "line 7: tip.count is -3; expected a whole number from 0 to 4294967295"),
            ("3", "3.5", "line 7: tip.count is 3.5; expected a whole number from 0 to 4294967295"),
            ("\"pad\"", "\"cone\"", "line 8: tip.shape is the text \"cone\"; expected pad or sphere"),
            ("\"x/1\"", "1", "line 1: format is 1; expected a text in quotes"),
            ("format = \"x/1\"\n", "", "format is missing"),
            ("count = 3\n", "", "line 3: tip.count is missing"),
            (
                "count",
                "cuont",
                "line 7: tip.cuont is not known; expected one of radius_mm, axis, count, shape",
            ),
        ] {
            assert_eq!(said(from, to), words, "{to}");
        }
        let text = "format = \"x/1\"\ntip = 8.0\n";
        let error = toml::from_str::<Keys>(text).expect_err("no table");
        assert_eq!(unread_toml(text, &error), "line 2: tip is 8.0; expected a table");
        let torn = said("8.0", "8.0.1");
        assert!(torn.starts_with("line 4: ") && torn.ends_with("in \"radius_mm = 8.0.1\""), "{torn}");
        let twice = said("count = 3", "count = 3\ncount = 4");
        assert!(twice.starts_with("line 8: ") && twice.contains("count = 4"), "{twice}");
    }
}

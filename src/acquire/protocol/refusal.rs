//! Why was a protocol refused: file, line, column, section, and what is wrong there.

use std::fmt;

/// One reason why a protocol cannot be used.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// The file, or what stands for it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Character of the line, from 1.
    pub column: usize,
    /// Part of the file, such as `step 3 (poke)`.
    pub section: String,
    /// What is wrong.
    pub problem: Box<Problem>,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: {}: {}", self.file, self.line, self.column, self.section, self.problem)
    }
}

/// What is wrong. Values are as the file writes them.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Problem {
    /// No TOML.
    #[error("not TOML: {message}")]
    NotToml {
        /// What the parser says.
        message: String,
    },
    /// A key that nobody reads.
    #[error("{key} = {value}; there is no such key{}; expected one of {}", meant(nearest), known.join(", "))]
    UnknownKey {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The known key that looks most like it.
        nearest: Option<String>,
        /// All keys that may stand there.
        known: Vec<&'static str>,
    },
    /// A key that has to be there.
    #[error("{key} is missing; expected {expected}")]
    MissingKey {
        /// The key.
        key: &'static str,
        /// What it should hold.
        expected: String,
    },
    /// A value that is not what the key takes.
    #[error("{key} = {value}; expected {expected}")]
    WrongValue {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What it takes.
        expected: String,
    },
    /// Two keys that say different things about one.
    #[error("{key} = {value} stands beside {other}; expected only one of them")]
    Exclusive {
        /// The one.
        key: &'static str,
        /// Its value.
        value: String,
        /// The other.
        other: &'static str,
    },
    /// A variable that is not defined.
    #[error(
        "{key} = \"${name}\"; there is no such variable{}; expected one of {}",
        meant(nearest),
        list(known)
    )]
    NoVariable {
        /// The key.
        key: String,
        /// The variable's name.
        name: String,
        /// The variable that looks most like it.
        nearest: Option<String>,
        /// All variables.
        known: Vec<String>,
    },
    /// A variable whose value the key does not take.
    #[error("{key} = \"{name}\", which is {number}; expected {expected}")]
    VariableOutside {
        /// The key.
        key: String,
        /// The variable as the file writes it, with its `$`.
        name: String,
        /// Its value, in the unit of its name.
        number: f64,
        /// What the key takes.
        expected: String,
    },
    /// A variable whose name ends in another unit than the key.
    #[error("{key} = \"${name}\", a variable in {unit}; expected one in {expected}")]
    WrongUnit {
        /// The key.
        key: String,
        /// The variable's name.
        name: String,
        /// The variable's unit.
        unit: &'static str,
        /// The key's unit.
        expected: &'static str,
    },
    /// A value from outside for a variable that is not defined.
    #[error(
        "{name} is set to {value}, but there is no such variable{}; expected one of {}",
        meant(nearest),
        list(known)
    )]
    UnknownOverride {
        /// The name.
        name: String,
        /// The value.
        value: f64,
        /// The variable that looks most like it.
        nearest: Option<String>,
        /// All variables.
        known: Vec<String>,
    },
    /// More pokes than anybody wants.
    #[error("{asked} pokes and cycles up to here; expected {most} at most")]
    TooMany {
        /// What the steps up to here ask for.
        asked: u64,
        /// What is taken.
        most: u64,
    },
}

fn meant(nearest: &Option<String>) -> String {
    nearest.as_ref().map(|n| format!("; did you mean {n}?")).unwrap_or_default()
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none: [variables] is empty".to_owned() } else { names.join(", ") }
}

/// Names are taken for a slip of one another from this similarity (Jaro–Winkler, 0 to 1).
const ALIKE: f64 = 0.75;

/// The known name that looks most like `name`, if one does.
pub(super) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    let rated = known.map(|k| (strsim::jaro_winkler(name, k), k));
    let best = rated.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(alike, _)| *alike >= ALIKE);
    best.map(|(_, k)| k.to_owned())
}

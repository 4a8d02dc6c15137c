//! Names of channels and phases, for programs and for people.

use crate::diagnose::{Channel, Phase};

/// The kind of reading: `force` or `markers`.
pub(super) fn coarse_channel(channel: Channel) -> &'static str {
    match channel {
        Channel::ForceAlong | Channel::ForceAcross => "force",
        Channel::Markers(_) => "markers",
    }
}

/// The kind of reading with its direction.
pub(super) fn channel_name(channel: Channel) -> &'static str {
    match channel {
        Channel::ForceAlong => "force-along-the-poke",
        Channel::ForceAcross => "force-across-the-poke",
        Channel::Markers(0) => "markers-x",
        Channel::Markers(1) => "markers-y",
        Channel::Markers(_) => "markers-z",
    }
}

/// The same in a sentence.
pub(super) fn channel_words(channel: Channel) -> &'static str {
    match channel {
        Channel::ForceAlong => "the force along the poke",
        Channel::ForceAcross => "the force across the poke",
        Channel::Markers(0) => "the markers along x",
        Channel::Markers(1) => "the markers along y",
        Channel::Markers(_) => "the markers along z",
    }
}

/// A phase as programs read it.
pub(super) fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "approach",
        Phase::Hold => "hold",
        Phase::Retreat => "retreat",
        Phase::Rest => "rest",
    }
}

/// A phase in a sentence.
pub(super) fn phase_words(phase: Phase) -> &'static str {
    match phase {
        Phase::Approach => "while the tip goes in",
        Phase::Hold => "while it stays",
        Phase::Retreat => "while it goes out",
        Phase::Rest => "between pokes",
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn listed<T: AsRef<str>>(words: &[T], last: &str) -> String {
    match words {
        [] => String::new(),
        [only] => only.as_ref().to_owned(),
        [before @ .., end] => {
            let before: Vec<&str> = before.iter().map(AsRef::as_ref).collect();
            format!("{} {last} {}", before.join(", "), end.as_ref())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_read_as_they_are_said() {
        assert_eq!(listed::<&str>(&[], "and"), "");
        assert_eq!(listed(&["a"], "and"), "a");
        assert_eq!(listed(&["a", "b"], "or"), "a or b");
        assert_eq!(listed(&["a", "b", "c"], "and"), "a, b and c");
    }
}

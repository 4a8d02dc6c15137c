//! TOML that a person wrote → keys, or a refusal with line, key and the known one that was probably meant.

use super::RigError;
use crate::units::unread_toml;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Names are taken for a slip of one another from this similarity on (Jaro–Winkler, 0 to 1).
const ALIKE: f64 = 0.8;

/// The tables of a rig file, but for what only the simulated bench may read.
const TABLES: [&str; 6] = ["stage", "force", "markers", "camera", "tip", "phantom"];

/// Reads keys of which none may be unknown.
pub(super) fn read<K: DeserializeOwned>(file: &Path, text: &str) -> Result<K, RigError> {
    toml::from_str(text).map_err(|error| RigError::Refused {
        file: file.to_owned(),
        nearest: nearest(error.message()),
        reason: unread_toml(text, &error),
    })
}

/// The known name that looks most like the unknown one, from what serde says of both: it puts every name between backticks,
/// the unknown one first.
fn nearest(message: &str) -> Option<String> {
    if !message.starts_with("unknown ") {
        return None;
    }
    let mut names = message.split('`').skip(1).step_by(2);
    let unknown = names.next()?;
    let rated = names.map(|known| (strsim::jaro_winkler(unknown, known), known));
    let best = rated.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(alike, _)| *alike >= ALIKE);
    best.map(|(_, known)| known.to_owned())
}

/// A rig file's text without the section that only the simulated bench may read, comments and order of the rest as they are.
///
/// Why by lines: what a session keeps should be what the person wrote.
pub(super) fn without_simulation(text: &str) -> String {
    let mut hidden = false;
    let mut kept = String::with_capacity(text.len());
    for line in text.lines() {
        let header = line.trim_start();
        if header.starts_with('[') {
            // Only a table's name ends what is hidden: a list may go on over several lines.
            let name = header.trim_start_matches('[').split([']', '.']).next().unwrap_or_default().trim();
            hidden = name == "simulation" || hidden && !TABLES.contains(&name);
        }
        if !hidden {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Keys {
        #[expect(dead_code, reason = "only refused")]
        travel_speed_mm_s: f64,
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_place_and_the_nearest_known_one() {
        let refused = read::<Keys>(Path::new("rig.toml"), "# a rig\ntravel_sped_mm_s = 3\n");
        let words = refused.expect_err("refused").to_string();
        for part in ["rig.toml", "line 2", "travel_sped_mm_s", "did you mean travel_speed_mm_s?"] {
            assert!(words.contains(part), "{words}");
        }
        let refused = read::<Keys>(Path::new("rig.toml"), "colour = 3\n").expect_err("refused").to_string();
        assert!(!refused.contains("did you mean"), "{refused}");
    }

    #[test]
    fn what_is_simulated_is_left_out_whole() {
        let text = "a = 1\n[stage]\nb = 2 # kept\n[simulation]\nseed = 3\n[[simulation.effect]]\nphysics = 'x'\nlist = [\n[1],\n[ 2 ]\n]\n[tip]\nc = 4\n";
        assert_eq!(without_simulation(text), "a = 1\n[stage]\nb = 2 # kept\n[tip]\nc = 4\n");
    }
}

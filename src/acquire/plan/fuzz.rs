//! No text makes reading, planning or drawing panic or run away. `FUZZ_INPUTS` says how many are tried.

use super::Plan;
use super::fixture::{START_M, bench};
use crate::acquire::AcquireError;
use crate::acquire::protocol::{MOST_STROKES, Protocol};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;

const EXAMPLES: [&str; 2] = [
    include_str!("../../../rigs/protocols/five-pokes.toml"),
    include_str!("../../../rigs/protocols/grid-and-cycles.toml"),
];

/// What a hand, or an editor, could put in the place of something.
const PIECES: [&str; 24] = [
    "-1",
    "0",
    "1e9",
    "1e-300",
    "nan",
    "inf",
    "0x10",
    "1_000",
    "[]",
    "[[1, 0, 0]]",
    "\"$deep_mm\"",
    "\"$",
    "true",
    "{}",
    "'''",
    "[[step]]\n",
    "[defaults]\n",
    "kind = \"air\"\n",
    "counts = [10000, 10000]\n",
    "repeats = 10000\n",
    "until_force_n = 0.2\n",
    "direction = [0.6, 0, -0.8]\n",
    "\u{feff}",
    "2026-11-22",
];

/// A few changes: bytes, pieces, whole lines twice, gone or elsewhere.
fn mutated(random: &mut ChaCha8Rng) -> String {
    let mut text = EXAMPLES[random.random_range(0..EXAMPLES.len())].to_owned();
    for _ in 0..random.random_range(1..5) {
        let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
        if lines.is_empty() {
            break;
        }
        let (a, b) = (random.random_range(0..lines.len()), random.random_range(0..lines.len()));
        text = match random.random_range(0..6) {
            0 => {
                lines.remove(a);
                lines.concat()
            }
            1 => {
                lines.insert(a, lines[b]);
                lines.concat()
            }
            2 => {
                lines.swap(a, b);
                lines.concat()
            }
            // The value of a key.
            3 => {
                let piece = PIECES[random.random_range(0..PIECES.len())];
                let changed = lines[a].split_once('=').map(|(key, _)| format!("{key}= {piece}\n"));
                let changed = changed.unwrap_or_else(|| piece.to_owned());
                lines[a] = &changed;
                lines.concat()
            }
            4 => {
                let mut characters: Vec<char> = text.chars().collect();
                let at = random.random_range(0..characters.len());
                characters[at] = char::from(random.random_range(1..127_u8));
                characters.into_iter().collect()
            }
            _ => {
                let digits: Vec<usize> =
                    text.char_indices().filter(|(_, c)| c.is_ascii_digit()).map(|(i, _)| i).collect();
                let at = digits[random.random_range(0..digits.len())];
                let (before, after) = text.split_at(at);
                format!("{before}{}{}", random.random_range(0..1000), &after[1..])
            }
        };
    }
    text
}

#[test]
fn nothing_that_is_written_breaks_a_plan() {
    let inputs: usize = std::env::var("FUZZ_INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(2000);
    let mut random = ChaCha8Rng::seed_from_u64(20);
    let bench = bench();
    let (mut read, mut sound) = (0, 0);
    for _ in 0..inputs {
        let text = mutated(&mut random);
        match Protocol::parse("fuzz.toml", &text, &[]) {
            Ok(protocol) => {
                read += 1;
                let steps = protocol.expand();
                assert!(steps.len() as u64 <= MOST_STROKES + text.len() as u64);
                let plan = Plan::new(protocol.name(), &steps, &bench, START_M);
                assert!(plan.duration_s.is_finite() && plan.duration_s >= 0.0, "{text}");
                assert!(!plan.drawing(&bench).contains("NaN"), "{text}");
                assert!(plan.table().lines().count() > steps.len());
                if let Ok(plan) = plan.checked() {
                    sound += 1;
                    // What may be run stays within the travel at every end of a motion.
                    let motions = plan.plan().steps.iter().flat_map(|s| &s.legs).filter_map(|leg| leg.motion);
                    for motion in motions {
                        assert_eq!(bench.limits.outside(motion.target_m), None, "{text}");
                    }
                }
            }
            Err(AcquireError::Protocol { refusals }) => {
                assert!(!refusals.is_empty());
                let last = text.lines().count() + 1;
                assert!(refusals.iter().all(|r| (1..=last).contains(&r.line) && r.column >= 1), "{text}");
            }
            Err(other) => panic!("{other}"),
        }
    }
    println!("{inputs} texts: {read} read, {sound} could be run");
    // Mutations that nothing survives, or that change nothing, would test little.
    assert!(read * 10 > inputs && read < inputs && sound > 0 && sound < read, "{read} {sound}");
}

//! How sure a verdict is, of what speaks for it.

use super::beyond::Beyond;
use super::diagnosis::Evidence;

/// A reading less sure than this is not named.
pub(super) const LEAST_CONFIDENCE: f64 = 0.5;

/// Confidence that nothing is left out, where nothing is called: where what the baseline leaves is less than half of all noise leaves and no
/// entry comes near to what is asked of it (`nearest` is the largest share that one explains by itself), and where something hardly shows.
/// Of 500 concealed draws 188 of 196 and 17 of 29 were right about it.
pub(super) fn nothing_left_out(p_value: f64, nearest: f64) -> f64 {
    let [nothing_shows, hardly] = NOTHING_LEFT_OUT;
    if p_value > HARDLY_SHOWS && nearest < NEAR { nothing_shows } else { hardly }
}

const NOTHING_LEFT_OUT: [f64; 2] = [0.95, 0.5];
const HARDLY_SHOWS: f64 = 0.5;

/// Where nothing acts but noise and a zero that wanders no entry came nearer, at first order, on 23 simulated recordings, fitted to the limit of
/// fine elements. What is asked of `--quick` ones was set by hand, and so was this for them.
pub(super) const NEAR: f64 = 0.55;

/// So many standard deviations are plain to see.
pub(super) const PLAIN_SD: f64 = 4.0;

/// Logistic in the evidence.
pub(super) fn confidence(evidence: &Evidence) -> f64 {
    let [constant, by_explained, by_gain, by_margin] = LOGISTIC;
    let score = constant
        + by_explained * evidence.explained
        + by_gain * evidence.gain.max(1.0).ln()
        + by_margin * evidence.margin.sqrt()
        + BY_THIRD * evidence.effects.saturating_sub(2) as f64;
    // What is left over may be a second effect, or the trace of another first one.
    let complete = MOST_SURE - PER_SD_LEFT * (evidence.left - HARDLY_LEFT_SD).max(0.0);
    (1.0 / (1.0 + (-score).exp())).min(complete.max(LEAST_COMPLETE))
}

/// Confidence lost for every standard deviation left beyond so many, down to this.
const PER_SD_LEFT: f64 = 0.03;
const HARDLY_LEFT_SD: f64 = 3.0;
const LEAST_COMPLETE: f64 = 0.55;

/// Confidence that what no entry explains is none of the catalogue: where it is plain to see, and where it hardly shows, and an entry may have
/// been too weak to be named.
pub(super) fn unlisted(before: &Beyond) -> f64 {
    let [plain, hardly] = UNLISTED;
    if before.deviations() > PLAIN_SD { plain } else { hardly }
}

const UNLISTED: [f64; 2] = [0.85, 0.4];

/// No verdict is surer than this: what nobody has thought of is always possible.
pub const MOST_SURE: f64 = 0.97;

/// Coefficients: constant, share explained, logarithm of the gain, root of the margin. Set by hand; `prove` shows
/// how well they are calibrated.
const LOGISTIC: [f64; 4] = [-11.0, 9.0, 1.2, 4.0];

/// For every effect beyond two: what is in no catalogue is taken for several that are.
const BY_THIRD: f64 = -4.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Surer where the baseline leaves less than noise mostly does and nothing nearly explains it, and never surer than a reading.
    #[test]
    fn what_hardly_shows_is_doubted() {
        assert!(nothing_left_out(0.8, 0.3) > 0.9 && nothing_left_out(0.8, 0.3) <= MOST_SURE);
        assert_eq!(nothing_left_out(0.05, 0.3), LEAST_CONFIDENCE);
        assert_eq!(nothing_left_out(0.8, 0.7), LEAST_CONFIDENCE);
    }

    /// What explains everything, by far and alone, is as sure as anything; a rival as good, a trace left over and a third effect lower it.
    #[test]
    fn confidence_follows_the_evidence() {
        let clear = Evidence { explained: 1.0, gain: 100.0, margin: 1.0, left: 0.0, effects: 1 };
        assert_eq!(confidence(&clear), MOST_SURE);
        assert!(confidence(&Evidence { gain: 10.0, ..clear }) > 0.9);
        let doubts = [
            Evidence { explained: 0.5, gain: 10.0, ..clear },
            Evidence { gain: 1.0, margin: 0.5, ..clear },
            Evidence { gain: 10.0, margin: 0.01, ..clear },
            Evidence { left: 10.0, ..clear },
            Evidence { gain: 3.0, effects: 3, ..clear },
        ];
        for doubt in doubts {
            assert!(confidence(&doubt) < 0.9, "{doubt:?}: {}", confidence(&doubt));
        }
    }
}

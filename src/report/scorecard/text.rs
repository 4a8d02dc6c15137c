//! The scorecard in lines of text.

use super::tally::{Limit, Scorecard, Share, Spread};
use std::fmt::Write;

/// The scorecard as a terminal shows it.
pub fn scorecard_text(card: &Scorecard) -> String {
    let how = if card.quick { ", diagnosed quickly" } else { "" };
    let mut text = format!("{} draws{how}, {:.1} s each on average\n\n", card.draws, card.mean_seconds);
    for [name, value] in rows(card) {
        // Writing to a String can't fail.
        let _ = writeln!(text, "{name:<58} {value}");
    }
    text.push_str("\nconfidence       draws   mean   right\n");
    for bin in &card.reliability {
        let [low, high] = bin.range;
        let _ = writeln!(text, "{low:.2} to {high:.2} {:>9} {:>6.2} {:>7.2}", bin.count, bin.mean, bin.right);
    }
    text.push_str("\nstrength             draws  detected\n");
    for bin in &card.detected_by_strength {
        let [low, high] = bin.range;
        let _ = writeln!(text, "{low:>7.1} to {high:<8.1} {:>5} {:>9.2}", bin.count, bin.right);
    }
    text.push_str("\nconcealed: how it came out\n");
    for line in &card.lines {
        let _ = writeln!(text, "  {}: {}", line.concealed, line.said());
    }
    text.truncate(text.trim_end().len());
    text
}

/// The figures by name, for text and page.
pub(super) fn rows(card: &Scorecard) -> Vec<[String; 2]> {
    let Limit { strength, share: least } = card.detection_limit;
    let mut above = String::new();
    if strength > 0.0 {
        let _ = write!(above, ", strength ≥ {strength}");
    }
    if least > 0.0 {
        let _ = write!(above, ", share ≥ {} %", 100.0 * least);
    }
    let row = |name: &str, value: String| [name.to_owned(), value];
    let limited = |name: &str, value: String| [format!("{name}{above}"), value];
    let percent = |spread: &Spread| size(spread, 100.0, " %");
    vec![
        limited("one effect: named right", share(card.named_right)),
        row("one effect, any strength: named right", share(card.named_right_all)),
        limited("several effects: all named", share(card.several_right)),
        limited("several effects: some named, nothing else", share(card.several_partly)),
        limited("each of several: all named", share(card.each_right)),
        limited("each of several: some named, nothing else", share(card.each_partly)),
        row("nothing concealed: false alarm", share(card.false_alarms)),
        limited("off the catalogue: called unexplained", share(card.off_catalogue_unexplained)),
        limited("off the catalogue: something named", share(card.off_catalogue_named)),
        limited("in the catalogue: abstained", share(card.abstained)),
        limited("in the catalogue: missed", share(card.missed)),
        limited("in the catalogue: wrong name", share(card.wrong_name)),
        row("ended without a verdict", share(card.failed)),
        row("place, named right", size(&card.place_error_m, 1e3, " mm")),
        row("parameters, named right", percent(&card.parameter_error)),
        row("modulus before, named right", percent(&card.modulus_error_before)),
        row("modulus after, named right", percent(&card.modulus_error_after)),
        row("modulus, nothing concealed", percent(&card.modulus_error_nothing)),
        row("held-out misfit before, named right", size(&card.held_out_before, 1.0, "")),
        row("held-out misfit after, named right", size(&card.held_out_after, 1.0, "")),
        row(
            "expected calibration error",
            match (card.calibration_error, card.calibration_error_by_chance) {
                (Some(error), Some(chance)) => format!("{error:.3}, chance alone {chance:.3}"),
                _ => "–".to_owned(),
            },
        ),
        row("90 % interval of the modulus holds it", share(card.coverage.modulus)),
        row("90 % intervals of parameters hold them", share(card.coverage.parameters)),
    ]
}

impl super::tally::Line {
    /// Outcomes in words, with what was named instead.
    pub(super) fn said(&self) -> String {
        let outcomes: Vec<String> =
            self.outcomes.iter().map(|(outcome, count)| format!("{count} {}", outcome.words())).collect();
        let instead: Vec<String> = self
            .instead
            .iter()
            .map(|(named, count)| {
                let named = if named.is_empty() { "a mismatch without a name" } else { named };
                format!("{count} × {named}")
            })
            .collect();
        match instead.is_empty() {
            true => outcomes.join(", "),
            false => format!("{} (said: {})", outcomes.join(", "), instead.join(", ")),
        }
    }
}

impl super::judge::Outcome {
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Partly => "partly",
            Self::Missed => "missed",
            Self::Abstained => "abstained",
            Self::FalseAlarm => "false alarm",
            Self::WrongName => "wrong name",
            Self::Failed => "failed",
        }
    }
}

fn share(share: Share) -> String {
    match share.all {
        0 => "–".to_owned(),
        all => format!("{} of {all} ({:.1} %)", share.of, 100.0 * share.of as f64 / all as f64),
    }
}

fn size(spread: &Spread, scale: f64, unit: &str) -> String {
    match (spread.median, spread.rms) {
        (Some(median), Some(rms)) => {
            format!("median {:.2}{unit}, rms {:.2}{unit} ({})", scale * median, scale * rms, spread.count)
        }
        _ => "–".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_measured_is_a_dash() {
        let text = scorecard_text(&Scorecard::of(Vec::new(), Limit { strength: 8.0, share: 0.005 }));
        assert!(text.starts_with("0 draws"), "{text}");
        assert!(text.contains("one effect: named right, strength ≥ 8, share ≥ 0.5 %"), "{text}");
        assert!(!text.contains("NaN"), "{text}");
        assert_eq!(share(Share { of: 9, all: 10 }), "9 of 10 (90.0 %)");
    }
}

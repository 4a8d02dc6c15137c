//! One draw in a few lines: what was concealed, and what was said of it.

use super::answer::{Answer, Figure};
use super::judge::{Draw, judge};
use super::said::{Number, Said, Verdict};
use crate::units::{pascals, three_digits};
use std::collections::BTreeMap;

/// What a draw concealed and what was said of it, side by side.
pub fn draw_text(draw: &Draw) -> String {
    let judged = judge(draw);
    let said = match &draw.said {
        Said::Verdict(verdict) => of_verdict(verdict, &draw.answer),
        Said::Failed(why) => format!("no verdict: {why}"),
    };
    format!(
        "{}: {}, in {:.0} s\n  concealed  {}\n  said       {said}",
        draw.name,
        judged.outcome.words(),
        draw.seconds,
        of_answer(&draw.answer)
    )
}

fn of_answer(answer: &Answer) -> String {
    let parameters = |id: &String| {
        let parameters = answer.parameters.get(id).into_iter().flatten();
        with_parameters(id, parameters.map(|(id, figure)| (id.as_str(), of_figure(figure))))
    };
    let own = |own: &BTreeMap<String, f64>| match own.len() {
        0 | 1 => String::new(),
        _ => {
            format!(" ({})", own.iter().map(|(id, s)| format!("{id} {s:.1}")).collect::<Vec<_>>().join(", "))
        }
    };
    let strength = answer.strength.map_or(String::new(), |s| {
        format!(", strength {s:.1}{}", answer.own_strength.as_ref().map_or(String::new(), own))
    });
    format!("{}; E {}{strength}", listed(&answer.physics, parameters), pascals(answer.young_modulus_pa))
}

fn of_verdict(verdict: &Verdict, answer: &Answer) -> String {
    let parameters = |id: &String| {
        let ids = answer.parameters.get(id).into_iter().flatten().map(|(id, _)| id.as_str());
        let found = ids.map(|name| (name, verdict.numbers(id, name)));
        let found = found.filter(|(_, numbers)| !numbers.is_empty());
        with_parameters(id, found.map(|(id, numbers)| (id, row(numbers.iter().map(of_number)))))
    };
    let [before, after] = verdict.modulus().map(|number| number.value.map_or("?".to_owned(), pascals));
    let or = match verdict.ambiguous_with() {
        [] => String::new(),
        others => format!(", or {}", others.join(", ")),
    };
    let sure = verdict.confidence().map_or(String::new(), |c| format!(", confidence {:.0} %", 100.0 * c));
    let mismatch = match (verdict.physics(), verdict.detected()) {
        ([], true) => "a mismatch without a name".to_owned(),
        (named, _) => listed(named, parameters),
    };
    format!("{mismatch}{or}; E {after} (before {before}){sure}")
}

fn listed(ids: &[String], one: impl Fn(&String) -> String) -> String {
    match ids {
        [] => "nothing".to_owned(),
        ids => ids.iter().map(one).collect::<Vec<_>>().join(" and "),
    }
}

fn with_parameters<'a>(id: &str, parameters: impl Iterator<Item = (&'a str, String)>) -> String {
    let parameters: Vec<String> = parameters.map(|(id, value)| format!("{id} {value}")).collect();
    match parameters.is_empty() {
        true => id.to_owned(),
        false => format!("{id} ({})", parameters.join(", ")),
    }
}

fn of_figure(figure: &Figure) -> String {
    match figure {
        Figure::Name(name) => name.clone(),
        numbers => row(numbers.numbers().iter().map(|x| three_digits(*x))),
    }
}

fn of_number(number: &Number) -> String {
    match (number.value, number.sd) {
        (Some(value), Some(sd)) => format!("{} ± {}", three_digits(value), three_digits(sd)),
        (Some(value), None) => three_digits(value),
        (None, _) => "?".to_owned(),
    }
}

fn row(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn both_sides_are_told() {
        let answer = serde_json::from_value(json!({
            "physics": ["late-contact"], "young_modulus_pa": 10100.0, "strength": 30.25,
            "parameters": {"late-contact": {"gap_m": 0.0008}},
        }))
        .expect("an answer");
        let verdict = serde_json::from_value(json!({
            "mismatch": {"detected": true},
            "verdict": {"physics": ["late-contact"], "confidence": 0.9, "ambiguous_with": ["tip-slip"]},
            "parameters": {"late-contact": {"gap_m": {"value": 0.00079, "sd": 0.00001}}},
            "baseline": {"young_modulus_pa": {"value": 9000.0, "sd": 100.0}, "held_out_chi2_per_dof": 5.0},
            "extended": {"young_modulus_pa": {"value": 10090.0, "sd": 90.0}, "held_out_chi2_per_dof": 1.0},
        }))
        .expect("a verdict");
        let draw = Draw {
            name: "draw-0001".to_owned(),
            answer,
            said: Said::Verdict(Box::new(verdict)),
            seconds: 12.0,
        };
        assert_eq!(
            draw_text(&draw),
            "draw-0001: right, in 12 s\n  concealed  late-contact (gap_m 0.000800); E 10.10 kPa, strength 30.2\n  \
             said       late-contact (gap_m 0.000790 ± 1.00e-5), or tip-slip; E 10.09 kPa (before 9.00 kPa), confidence 90 %"
        );
        let mut two = draw;
        two.answer.physics.push("drying".to_owned());
        two.answer.own_strength =
            Some([("late-contact".to_owned(), 29.0), ("drying".to_owned(), 4.0)].into());
        let text = draw_text(&two);
        assert!(text.contains("strength 30.2 (drying 4.0, late-contact 29.0)"), "{text}");
    }
}

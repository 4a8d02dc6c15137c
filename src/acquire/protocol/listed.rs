//! A plain list of pokes → a protocol of one step each.

use super::quantity::{Allowed, Unit};
use super::refusal::{Problem, Refusal};
use super::section::normalised;
use super::steps::{Kind, Place, Profile, Protocol, Step, Stroke, Target, Task, check_count};
use crate::acquire::AcquireError;

/// One poke of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedPoke {
    /// Tip centre on the undeformed surface (m, phantom frame).
    pub site_m: [f64; 3],
    /// Unit vector into the phantom.
    pub direction: [f64; 3],
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// Largest displacement of the stage (m).
    pub depth_m: f64,
    /// Speed of the stage, both ways (m/s).
    pub rate_m_s: f64,
    /// How long the largest displacement is held (s).
    pub hold_s: f64,
}

impl Protocol {
    /// A protocol that makes these pokes in order, with `pause_s` of rest before each (s). `source` is what refusals call the list;
    /// lines are its entries, from 1.
    ///
    /// # Errors
    /// [`AcquireError::Protocol`]: no poke, too many, and figures outside the ranges of a protocol file.
    pub fn of_pokes(
        source: &str,
        name: &str,
        pokes: &[ListedPoke],
        pause_s: f64,
    ) -> Result<Self, AcquireError> {
        let refuse = |line: usize, problem| Refusal {
            file: source.to_owned(),
            line,
            column: 1,
            section: format!("poke {line} of the list"),
            problem: Box::new(problem),
        };
        let refused = |line, problem| Err(AcquireError::Protocol { refusals: vec![refuse(line, problem)] });
        if pokes.is_empty() {
            return refused(1, Problem::MissingKey { key: "poke", expected: "at least one".to_owned() });
        }
        if let Err(problem) = check_count(pokes.len() as u64) {
            return refused(pokes.len(), problem);
        }
        let (mut steps, mut refusals) = (Vec::new(), Vec::new());
        for (poke, line) in pokes.iter().zip(1..) {
            match task(poke, pause_s) {
                Ok(task) => steps.push(Step { line, kind: Kind::Poke, task }),
                Err(problem) => refusals.push(refuse(line, problem)),
            }
        }
        if !refusals.is_empty() {
            return Err(AcquireError::Protocol { refusals });
        }
        Ok(Self { name: name.to_owned(), notes: None, variables: Vec::new(), steps })
    }
}

fn task(poke: &ListedPoke, pause_s: f64) -> Result<Task, Problem> {
    let [x, y, z] = poke.site_m;
    for (key, value, allowed) in [
        ("site_mm", x, Allowed::PLACE_MM),
        ("site_mm", y, Allowed::PLACE_MM),
        ("site_mm", z, Allowed::PLACE_MM),
        ("radius_mm", poke.radius_m, Allowed::RADIUS_MM),
        ("depth_mm", poke.depth_m, Allowed::DEPTH_MM),
        ("speed_mm_s", poke.rate_m_s, Allowed::SPEED_MM_S),
        ("hold_s", poke.hold_s, Allowed::TIME_S),
        ("pause_s", pause_s, Allowed::TIME_S),
    ] {
        let unit = Unit::of(key);
        let value = value / unit.si(1.0);
        if !allowed.holds(value) {
            let (key, expected) = (key.to_owned(), allowed.words(unit));
            return Err(Problem::WrongValue { key, value: value.to_string(), expected });
        }
    }
    let direction = normalised(poke.direction).map_err(|expected| {
        let value = format!("{:?}", poke.direction);
        Problem::WrongValue { key: "direction".to_owned(), value, expected }
    })?;
    let stroke = Stroke {
        direction: Some(direction),
        profile: Profile::Press { target: Target::Depth { depth_m: poke.depth_m }, hold_s: poke.hold_s },
        speed_m_s: poke.rate_m_s,
        retreat_speed_m_s: poke.rate_m_s,
        pause_s,
        air: false,
        radius_m: Some(poke.radius_m),
    };
    Ok(Task::Strokes { stroke, places: vec![Place { number: 1, site_m: poke.site_m }], repeats: 1 })
}

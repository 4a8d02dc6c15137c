//! What does a plan ask for that the bench can do and nobody means: a depth in metres under a name in millimetres?
//!
//! Nothing speaks against such a poke, so it is told and not refused.

use super::motions::Plan;
use super::violation::At;
use crate::acquire::protocol::{Action, Profile, Target};

/// A poke that is not so deep tells nothing of a phantom (m): surface and stage are known no better. Up to 50 mm, written in metres and taken for
/// millimetres, are less.
const LEAST_DEPTH_M: f64 = 5e-5;

impl Plan {
    /// What is probably written in another unit than its name says, as sentences: each depth once, with the first poke that goes there.
    pub fn doubts(&self) -> Vec<String> {
        let mut shallow: Vec<(f64, At, usize)> = Vec::new();
        for step in self.steps.iter().map(|step| &step.step) {
            let Action::Stroke { stroke, .. } = &step.action else { continue };
            // A depth that only limits another aim, or an amplitude, may be small.
            let Profile::Press { target: Target::Depth { depth_m }, .. } = stroke.profile else { continue };
            if stroke.air || depth_m >= LEAST_DEPTH_M {
                continue;
            }
            match shallow.iter_mut().find(|(known_m, ..)| *known_m == depth_m) {
                Some((.., pokes)) => *pokes += 1,
                None => shallow.push((depth_m, At::from(step), 1)),
            }
        }
        let say = |(depth_m, at, pokes): (f64, At, usize)| {
            let more = if pokes > 1 { format!(", and {} more like it", pokes - 1) } else { String::new() };
            format!(
                "{at}{more}: it goes {:.4} mm deep, which probably tells nothing; depths are in mm in a protocol, and in m in a table of pokes",
                1e3 * depth_m
            )
        };
        shallow.into_iter().map(say).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{bench, plan, poke};

    #[test]
    fn a_depth_in_metres_is_doubted_and_a_shallow_poke_is_not() {
        let doubts = |steps: &str| plan(steps, &bench()).doubts();
        let shallow = poke("depth_mm = 0.003\nrepeats = 3\npause_s = 5");
        let [doubt] = &doubts(&(shallow + &poke("")))[..] else { panic!("one doubt") };
        let words = "step 1.1.1 (poke, line 6), poke 1, and 2 more like it: it goes 0.0030 mm deep";
        assert!(doubt.starts_with(words) && doubt.ends_with("in m in a table of pokes"), "{doubt}");
        assert!(doubts(&poke("depth_mm = 0.1")).is_empty());
        // In the air nothing is deep.
        assert!(doubts("[[step]]\nkind = \"air\"\nsite_mm = [50, 75, 40]\ndepth_mm = 0.003\n").is_empty());
    }
}

//! How readings are weighed: what elements get wrong in the force is estimated from what is left.

use super::small::{body, problem, recording};
use phantom_rig::inverse::{Driven, Evidence, State};
use phantom_rig::observation::{Contact, Tip, TipShape};

/// Forces that are off by a fifth, up in one reading and down in the next, are weighed as such: what is left then has
/// the size of its weight. Forces that the model explains keep the smallest error.
#[test]
fn the_elements_error_is_found_in_what_is_left() {
    let recording = recording(body(), false, Tip { shape: TipShape::Pad, contact: Contact::Bonded });
    let mut evidence = Evidence::new(&recording, Some(Driven::ByStage)).expect("a stage");
    let state = State { modulus: 9.3e3, patches: Vec::new() };
    let prediction = {
        let problem = problem(&recording, &evidence);
        problem.linearise(&state).expect("sound").prediction
    };
    for off in [0.0, 0.2] {
        let mut sign = 1.0;
        for (site, map) in evidence.sites.iter_mut().zip(&prediction.sites) {
            for reading in &mut site.force {
                let exact = &map.force * reading.drive;
                reading.value = exact.fixed_rows::<3>(0) * (1.0 + sign * off);
                sign = -sign;
            }
        }
        let forces: usize = evidence.sites.iter().map(|site| 3 * site.force.len()).sum();
        let mut problem = problem(&recording, &evidence);
        let at = problem.linearise(&state).expect("sound");
        let left = at.residual.rows(0, forces).norm_squared() / forces as f64;
        problem.whitening = problem.whitening.with_likeliest_elements(&at);
        let again = problem.linearise(&state).expect("sound");
        let weighed = again.residual.rows(0, forces).norm_squared() / forces as f64;
        println!("off by {off}: {left} before, {weighed} after");
        if off == 0.0 {
            assert_eq!(at.residual, again.residual);
        } else {
            assert!(left > 4.0, "{left}");
            assert!((0.2..1.0).contains(&weighed), "{weighed}");
        }
    }
}

//! Draws of the virtual bench, fitted.

use phantom_rig::inverse::{Fit, PatchKind, Settings, fit};
use phantom_rig::sim::{Draw, Wander, draw, record};

/// A draw, and its fit on a mesh of its own.
fn fitted(seed: u64, quick: bool) -> (Draw, Fit) {
    let session = Draw { fit_cell_m: 0.008, ..draw(seed) };
    let recording = record(&session).expect("a recording");
    let found = fit(&recording, &Settings { quick, ..Settings::default() }, &mut |_| {}).expect("a fit");
    (session, found)
}

/// Relative.
fn error_of_modulus(session: &Draw, found: &Fit) -> f64 {
    found.young_modulus_pa.value / session.young_modulus_pa - 1.0
}

/// Of three bands two are found: springs take the place of glue, and with that a patch goes that is no longer needed. What is asked next is
/// asked of those that stay.
#[test]
fn a_patch_may_go_with_the_glue_of_another() {
    let (session, found) = fitted(20_073, false);
    let error = error_of_modulus(&session, &found);
    // What the discretisation promises; less than the limit that the fit states for noise.
    assert!(error.abs() < 5e-3, "{error}");
    assert!(found.residual.chi2_per_dof < 1.02, "{:?}", found.residual);
    assert!(!found.patches.is_empty() && found.patches.len() <= session.restraints.len());
}

/// Of one glued spot weak springs say nothing: a modulus that is 6 % off has taken up what they could explain.
#[test]
fn glue_is_found_where_weak_springs_promise_nothing() {
    let (session, found) = fitted(20_652, true);
    let kinds: Vec<_> = found.patches.iter().map(|patch| &patch.kind).collect();
    assert!(matches!(kinds[..], [PatchKind::Glued { .. }]), "{kinds:?}");
    let error = error_of_modulus(&session, &found);
    assert!(error.abs() < 0.01, "{error}");
}

/// A first patch stands for two bands at once, becomes glue and goes to the edge: it is let go of when both are found.
#[test]
fn a_patch_that_stood_for_two_is_let_go_of() {
    let (session, found) = fitted(20_164, false);
    assert_eq!(found.patches.len(), session.restraints.len(), "{:?}", found.patches);
    assert!(found.patches.iter().all(|patch| matches!(patch.kind, PatchKind::Springs { .. })));
    let error = error_of_modulus(&session, &found);
    assert!(error.abs() < 0.01, "{error}");
}

/// A camera that sways by a good part of its noise, and a sensor whose zero wanders by as much as a row's noise, are no restraint.
#[test]
fn what_sways_and_wanders_is_no_restraint() {
    for seed in [20_002, 20_011] {
        let mut session = Draw { fit_cell_m: 0.008, ..draw(seed) };
        session.instruments.wander = Some(Wander { force_n: 0.004, marker_m: 1.5e-5, time_s: 15.0 });
        let recording = record(&session).expect("a recording");
        let found = fit(&recording, &Settings::default(), &mut |_| {}).expect("a fit");
        let modulus = found.young_modulus_pa;
        let off = (modulus.value - session.young_modulus_pa) / modulus.sd;
        println!("{seed}: {:?} {:?} {:?}", session.restraints, found.patches, found.residual);
        println!("modulus {off:.2} deviations off");
        assert!(off.abs() < 3.0, "{off}");
        for what in ["all markers move together", "the zero of the force wanders"] {
            assert!(found.remarks.iter().any(|r| r.contains(what)), "{what}: {:?}", found.remarks);
        }
        assert_eq!(found.patches.len(), session.restraints.len());
        assert!(found.residual.chi2_per_dof < found.residual.chi2_per_dof_limit, "{:?}", found.residual);
    }
}

//! Draws of the virtual bench, fitted.

use phantom_rig::inverse::{Settings, fit};
use phantom_rig::sim::{Draw, draw, record};

/// Of three bands two are found: springs take the place of glue, and with that a patch goes that is no longer needed. What is asked next is
/// asked of those that stay.
#[test]
fn a_patch_may_go_with_the_glue_of_another() {
    let session = Draw { fit_cell_m: 0.008, ..draw(20_073) };
    let found =
        fit(&record(&session).expect("a recording"), &Settings::default(), &mut |_| {}).expect("a fit");
    let error = found.young_modulus_pa.value / session.young_modulus_pa - 1.0;
    // What the discretisation promises; less than the limit that the fit states for noise.
    assert!(error.abs() < 5e-3, "{error}");
    assert!(found.residual.chi2_per_dof < 1.02, "{:?}", found.residual);
    assert!(!found.patches.is_empty() && found.patches.len() <= session.restraints.len());
}

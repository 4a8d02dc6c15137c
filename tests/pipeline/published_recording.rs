//! The published method on recordings: a simulated one, and one of a third-party finite-element code.

use phantom_rig::dataset::read_bundle;
use phantom_rig::fem::Order;
use phantom_rig::inverse::published::{Variant, fit_recording};
use phantom_rig::inverse::{Fit, FitMethod};
use std::path::{Path, PathBuf};

fn fitted(bundle: &Path) -> Fit {
    let (recording, _) = read_bundle(bundle).expect("a sound recording");
    fit_recording(&recording, Variant::Published, Order::P1, &|| ()).expect("a fit")
}

/// Whatever the method makes of it, the fit is whole: a view a poke, a modulus within the operator's range and no
/// deviation that nobody computed; and it owns up to what it leaves.
fn is_whole(fit: &Fit, pokes: usize, range: std::ops::Range<f64>) {
    assert_eq!(fit.method, FitMethod::Published(Variant::Published));
    assert_eq!(fit.pokes.len(), pokes);
    assert!(range.contains(&fit.young_modulus_pa.value), "{:?}", fit.young_modulus_pa);
    assert!(fit.young_modulus_pa.sd.is_nan() && fit.restraint_total_n_per_m.sd.is_nan());
    assert!(fit.residual.chi2_per_dof > fit.residual.chi2_per_dof_limit, "{:?}", fit.residual);
    assert!(fit.remarks.iter().any(|r| r.contains("do not explain")), "{:?}", fit.remarks);
    assert!(fit.pokes.iter().all(|p| p.markers.len() > 20 && !p.samples.is_empty()));
}

/// The bundled recording, made by a bench that shares no element with the fit.
#[test]
fn a_simulated_recording_gets_a_whole_fit() {
    let fit = fitted(&Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/demo"));
    is_whole(&fit, 5, 5e3..2e4);
}

#[test]
fn a_third_party_recording_gets_a_whole_fit() {
    let root = std::env::var_os("PHANTOM_RIG_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let bundle = root.join("practice/practice-01");
    if !bundle.is_dir() {
        println!("skipped: no data ({})", bundle.display());
        return;
    }
    is_whole(&fitted(&bundle), 7, 5e3..2e4);
}

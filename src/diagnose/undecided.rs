//! What can be said of a recording that no reading can be held against: the wrench drives it, the tip's force is not in
//! proportion to its displacement, or it has so few pokes that none can be predicted from the others.
//!
//! Whether the baseline leaves more than noise, in which direction, whether anything moves on while the force stands still,
//! and what could have done it. Nothing is named: a single state is explained by many entries, each as well as the next.

use super::diagnosis::{Channel, Diagnosis, Estimate, Mismatch, Reading, Restrained, Settings, Verdict};
use super::error::DiagnoseError;
use super::physics::Physics;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::inverse::{self, Driven, Fit, Patch, PatchKind, Settled, outcome};
use crate::observation::Recording;
use statrs::distribution::{ContinuousCDF, Normal};

/// Standard deviations at which a fit's limit of chance stands (99.9 %).
const LIMIT_SD: f64 = 3.09;

/// An axis shows a misfit when it holds this share of it.
const SHARE: f64 = 0.1;

/// Slopes are of the instruments unless they are this many standard deviations long.
const CREEPS_SD: f64 = 5.0;

/// How surely nothing is left out where nothing shows, and something unknown where something does: a recording of this kind
/// decides neither.
const UNDECIDED: f64 = 0.5;

/// What `found` says, `why` no reading was tried.
///
/// # Errors
/// [`DiagnoseError::Baseline`] where the fit has no outcome.
pub(super) fn undecided(
    found: &Settled<'_>,
    why: &DiagnoseError,
    settings: &Settings,
) -> Result<Diagnosis, DiagnoseError> {
    let fit = outcome(found)?;
    let left = &fit.residual;
    let expected = left.chi2_per_dof_expected;
    let beyond = (left.chi2_per_dof - expected) / (left.chi2_per_dof_limit - expected).max(f64::MIN_POSITIVE)
        * LIMIT_SD;
    let p_value = Normal::standard().sf(beyond).max(f64::MIN_POSITIVE);
    let detected = p_value < settings.false_alarm;
    let creep = creep(found.recording, found.evidence.noise.marker_m);
    let suspects = if detected { suspects(found, creep.is_some()) } else { Vec::new() };
    let mut remarks = vec![format!("nothing is named: {why}")];
    let mut properties = Vec::new();
    if let Some((speed, sd)) = creep {
        properties.push(format!(
            "markers move on by {:.2} mm/s ({sd:.0} standard deviations) within a poke: it has a memory, or the load was not still",
            1e3 * speed
        ));
    }
    if detected {
        remarks.push(decides(found.evidence.driven));
    }
    let reading = reading(&fit);
    Ok(Diagnosis {
        recording: found.recording.name.clone(),
        mismatch: Mismatch {
            detected,
            p_value,
            channels: if detected { channels(&fit, found.evidence.noise.marker_m) } else { Vec::new() },
            pokes: Vec::new(),
            phases: Vec::new(),
            region: None,
            properties,
        },
        verdict: Verdict {
            physics: Vec::new(),
            unexplained: detected,
            explained_by: Vec::new(),
            confidence: UNDECIDED,
            ambiguous_with: suspects,
            evidence: None,
        },
        parameters: Vec::new(),
        candidates: Vec::new(),
        baseline: reading.clone(),
        extended: reading,
        next_poke: None,
        curves: Vec::new(),
        remarks: remarks.into_iter().chain(fit.remarks).collect(),
    })
}

fn estimate(of: inverse::Estimate) -> Estimate {
    Estimate { value: of.value, sd: of.sd }
}

fn reading(fit: &Fit) -> Reading {
    Reading {
        young_modulus_pa: estimate(fit.young_modulus_pa),
        restraint_total_n_per_m: estimate(fit.restraint_total_n_per_m),
        restraint: fit.patches.iter().map(patch).collect(),
        chi2_per_dof: fit.residual.chi2_per_dof,
        held_out_chi2_per_dof: f64::NAN,
    }
}

fn patch(of: &Patch) -> Restrained {
    let stiffness_n_per_m = match of.kind {
        PatchKind::Springs { stiffness_n_per_m: own } => Some(estimate(own)),
        PatchKind::Glued { .. } => None,
    };
    let &Patch { centroid_m, centroid_sd_m, radius_m, .. } = of;
    Restrained { centroid_m, centroid_sd_m: Some(centroid_sd_m), radius_m, stiffness_n_per_m }
}

/// Entries that could have left such a misfit: of the body and its hold, of the camera, and of the stage where there is one.
fn suspects(found: &Settled<'_>, creeps: bool) -> Vec<Physics> {
    let of_body = [
        Physics::FiniteStrain,
        Physics::StrainStiffening,
        Physics::CompliantBase,
        Physics::BaseDebonding,
        Physics::Anisotropy,
        Physics::CameraMisalignment,
        Physics::CameraScale,
    ];
    let of_memory = [Physics::ViscoelasticRelaxation];
    let of_stage = [Physics::StageCompliance, Physics::LateContact, Physics::TipSlip, Physics::ForceGain];
    let weighs = found.recording.phantom.gravity.is_none();
    let by_stage = found.evidence.driven == Driven::ByStage;
    of_memory
        .into_iter()
        .filter(|_| creeps)
        .chain(of_body)
        .chain(of_stage.into_iter().filter(|_| by_stage))
        .chain(weighs.then_some(Physics::SelfWeight))
        .collect()
}

fn decides(driven: Driven) -> String {
    match driven {
        Driven::ByWrench => "what would decide: the same load put on and taken off again several times with the unloaded pose \
             seen before and after (what does not come back is memory, or the rest pose was not at rest), held for a minute \
             (what creeps on is memory), then half and twice the load (what is not in proportion is large strain), with \
             markers on the hold itself (what moves there is its give)"
            .to_owned(),
        Driven::ByStage => "what would decide: more pokes, at two places at least, each shallow and deep, slow and fast, with a \
             hold of several seconds"
            .to_owned(),
    }
}

/// Axes along which the markers miss, the strongest first.
fn channels(fit: &Fit, sd_m: [f64; 3]) -> Vec<Channel> {
    let mut along: Vec<(u8, f64)> = (0..3_u8)
        .map(|axis| {
            let a = usize::from(axis);
            let markers = fit.pokes.iter().flat_map(|poke| &poke.markers);
            (axis, markers.map(|m| ((m.measured_m - m.modelled_m)[a] / sd_m[a]).powi(2)).sum())
        })
        .collect();
    let all: f64 = along.iter().map(|a| a.1).sum();
    along.retain(|(_, square)| *square > SHARE * all);
    along.sort_by(|a, b| b.1.total_cmp(&a.1));
    along.into_iter().map(|(axis, _)| Channel::Markers(axis)).collect()
}

/// Fastest steady motion (m/s) of a marker in the middle half of a poke in which the force stands still, with how many
/// standard deviations it is from rest. `None` where none is.
fn creep(recording: &Recording, sd_m: [f64; 3]) -> Option<(f64, f64)> {
    let mut fastest: Option<(f64, f64)> = None;
    for poke in &recording.pokes {
        let quarter = 0.25 * (poke.end_s - poke.start_s);
        let (from, to) = (poke.start_s + quarter, poke.end_s - quarter);
        if !stands_still(recording, from, to) {
            continue;
        }
        for marker in 0..recording.markers.numbers.len() {
            let rows = recording.markers.rows.iter().filter(|row| row.marker as usize == marker);
            let at = |frame: u32| recording.markers.frame_time_s[frame as usize];
            let seen: Vec<(f64, Vec3)> = rows
                .map(|row| (at(row.frame), Vec3::from(row.position_m)))
                .filter(|(t, _)| *t >= from && *t <= to)
                .collect();
            let mean = seen.iter().map(|s| s.0).sum::<f64>() / seen.len() as f64;
            let spread: f64 = seen.iter().map(|s| (s.0 - mean).powi(2)).sum();
            if seen.len() < 4 || spread <= 0.0 {
                continue;
            }
            let slope: Vec3 = seen.iter().map(|(t, p)| p * ((t - mean) / spread)).sum();
            let sd = sd_m.map(|sd| sd / spread.sqrt());
            let deviations = (0..3).map(|i| (slope[i] / sd[i]).abs()).fold(0.0, f64::max);
            if deviations > CREEPS_SD && fastest.is_none_or(|(speed, _)| slope.norm() > speed) {
                fastest = Some((slope.norm(), deviations));
            }
        }
    }
    fastest
}

/// Whether tip and force stay within their noise between two times.
fn stands_still(recording: &Recording, from_s: f64, to_s: f64) -> bool {
    let stays = |time_s: &[f64], rows: &[[f64; 3]], sd: [f64; 3]| {
        let within = Rows::new(time_s).within(from_s, to_s);
        (0..3).all(|axis| {
            let values = rows[within.clone()].iter().map(|row| row[axis]);
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
            high - low < 8.0 * sd[axis]
        })
    };
    match &recording.stage {
        Some(stage) => stays(&stage.time_s, &stage.displacement_m, recording.noise.stage_m),
        None => stays(&recording.wrench.time_s, &recording.wrench.force_n, recording.noise.force_n),
    }
}

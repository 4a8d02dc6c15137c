//! Diagnoses with plausible values, made without a model: one for each kind of verdict.
//!
//! Nothing here is a result; the tests only ask whether what goes in is what is shown.

use super::synthetic;
use phantom_rig::diagnose::{
    Candidate, Channel, Curve, Diagnosis, Estimate, Evidence, Found, Mismatch, NextPoke, Parameter, Phase,
    Physics, Reading, Region, Restrained, Verdict,
};
use phantom_rig::geometry::Vec3;
use phantom_rig::observation::PlannedPoke;
use phantom_rig::observation::Recording;

fn parameter(id: &'static str, value: f64, sd: f64, list: bool) -> Parameter {
    Parameter { id, values: vec![Estimate { value, sd }], list }
}

fn reading(modulus: f64, sd: f64, held_out: f64) -> Reading {
    Reading {
        young_modulus_pa: Estimate { value: modulus, sd },
        restraint_total_n_per_m: Estimate { value: 124.3, sd: 2.4 },
        restraint: vec![
            Restrained {
                centroid_m: Vec3::new(0.12, 0.05, 0.0),
                centroid_sd_m: Some(Vec3::new(4e-4, 3e-4, 0.0)),
                radius_m: 0.005,
                stiffness_n_per_m: Some(Estimate { value: 124.3, sd: 2.4 }),
            },
            Restrained {
                centroid_m: Vec3::new(0.08, 0.03, 0.0),
                centroid_sd_m: None,
                radius_m: 0.007,
                stiffness_n_per_m: None,
            },
        ],
        chi2_per_dof: held_out * 0.99,
        held_out_chi2_per_dof: held_out,
    }
}

fn candidate(physics: &[Physics], score: f64, held_out: Option<f64>, selected: bool, why: &str) -> Candidate {
    Candidate {
        physics: physics.to_vec(),
        score,
        held_out_chi2_per_dof: held_out,
        selected,
        why: why.to_owned(),
    }
}

/// Relaxation of 22 % with 4.0 s, found.
pub(crate) fn relaxation(recording: &Recording) -> Diagnosis {
    Diagnosis {
        recording: recording.name.clone(),
        mismatch: Mismatch {
            detected: true,
            p_value: 1e-9,
            channels: vec![Channel::ForceAlong, Channel::Markers(2), Channel::ForceAcross],
            pokes: vec![2, 3],
            phases: vec![Phase::Hold],
            region: None,
            properties: vec!["it has memory: holds differ from approaches".to_owned()],
        },
        verdict: Verdict {
            physics: vec![Physics::ViscoelasticRelaxation],
            unexplained: false,
            explained_by: Vec::new(),
            confidence: 0.97,
            ambiguous_with: Vec::new(),
            evidence: Some(Evidence { explained: 0.98, gain: 900.0, margin: 0.4, left: 1.5, effects: 1 }),
        },
        parameters: vec![Found {
            physics: Physics::ViscoelasticRelaxation,
            parameters: vec![
                parameter("relaxed_fraction", 0.22, 0.01, true),
                parameter("time_constant_s", 4.0, 0.5, true),
            ],
            law: None,
        }],
        candidates: vec![
            candidate(
                &[Physics::ViscoelasticRelaxation],
                5210.0,
                Some(1.02),
                true,
                "removes all that can be removed",
            ),
            candidate(
                &[Physics::BandViscosity],
                1480.0,
                Some(9.1),
                false,
                "pokes far from the restraint relax as well",
            ),
            candidate(&[Physics::CameraLag], 310.0, None, false, "the force shows it as much as the camera"),
            candidate(&[], 0.0, Some(14.2), false, "leaves 14.2 where noise leaves 1"),
        ],
        baseline: reading(10_000.0, 90.0, 14.2),
        extended: reading(8_700.0, 50.0, 1.02),
        next_poke: None,
        curves: curves(recording, 0.22),
        remarks: vec!["Terms slower than 40 s look like a softer phantom.".to_owned()],
    }
}

/// A debonded disc or a soft inclusion: the recording cannot tell.
pub(crate) fn set(recording: &Recording) -> Diagnosis {
    let mut diagnosis = relaxation(recording);
    diagnosis.mismatch.phases = vec![Phase::Approach, Phase::Hold, Phase::Retreat];
    diagnosis.mismatch.pokes = vec![7];
    diagnosis.mismatch.region = Some(Region { centroid_m: Vec3::new(0.068, 0.052, 0.006), radius_m: 0.011 });
    diagnosis.verdict = Verdict {
        physics: vec![Physics::Inclusion],
        unexplained: false,
        explained_by: Vec::new(),
        confidence: 0.62,
        ambiguous_with: vec![Physics::BaseDebonding],
        evidence: None,
    };
    diagnosis.parameters = vec![
        Found {
            physics: Physics::Inclusion,
            parameters: vec![
                parameter("centre_x_m", 0.07, 0.001, false),
                parameter("centre_y_m", 0.05, 0.001, false),
                parameter("centre_z_m", 0.008, 0.002, false),
                parameter("radius_m", 0.007, 0.001, false),
                parameter("modulus_ratio", 0.31, 0.09, false),
            ],
            law: None,
        },
        Found {
            physics: Physics::BaseDebonding,
            parameters: vec![
                parameter("centre_x_m", 0.05, 0.001, false),
                parameter("centre_y_m", 0.05, 0.001, false),
                parameter("radius_m", 0.009, 0.001, false),
            ],
            law: None,
        },
    ];
    diagnosis.next_poke = Some(NextPoke {
        why: "A debonded base opens under a pull; an inclusion does not.".to_owned(),
        separates: vec![Physics::Inclusion, Physics::BaseDebonding],
        poke: PlannedPoke {
            site: Vec3::new(0.05, 0.05, 0.025),
            direction: -Vec3::z(),
            radius_m: 0.008,
            depth_m: 0.003,
            rate_m_s: 0.002,
            hold_s: 2.0,
        },
    });
    diagnosis
}

/// Nothing left out.
pub(crate) fn nothing(recording: &Recording) -> Diagnosis {
    let baseline = reading(10_000.0, 90.0, 1.01);
    Diagnosis {
        mismatch: Mismatch {
            detected: false,
            p_value: 0.43,
            channels: Vec::new(),
            pokes: Vec::new(),
            phases: Vec::new(),
            region: None,
            properties: Vec::new(),
        },
        verdict: Verdict {
            physics: Vec::new(),
            unexplained: false,
            explained_by: Vec::new(),
            confidence: 0.98,
            ambiguous_with: Vec::new(),
            evidence: None,
        },
        parameters: Vec::new(),
        candidates: Vec::new(),
        baseline: baseline.clone(),
        extended: baseline,
        remarks: Vec::new(),
        curves: curves(recording, 0.0),
        ..relaxation(recording)
    }
}

/// Something, and nothing in the catalogue.
pub(crate) fn unexplained(recording: &Recording) -> Diagnosis {
    let found = relaxation(recording);
    Diagnosis {
        verdict: Verdict {
            physics: Vec::new(),
            unexplained: true,
            explained_by: Vec::new(),
            confidence: f64::NAN,
            ambiguous_with: Vec::new(),
            evidence: None,
        },
        parameters: Vec::new(),
        extended: found.baseline.clone(),
        ..found
    }
}

/// A force that relaxes by `share`; the baseline's does not.
fn curves(recording: &Recording, share: f64) -> Vec<Curve> {
    let fit = synthetic::fit(recording);
    let curve = |poke: &phantom_rig::inverse::PokeView| {
        let start = poke.samples[0].time_s;
        let relaxed = |t: f64| 1.0 - share * (1.0 - (-(t - start) / 4.0).exp());
        let along = |f: [f64; 3]| Vec3::from(f).dot(&poke.direction);
        let of = |f: &dyn Fn(&phantom_rig::inverse::Sample) -> f64| poke.samples.iter().map(f).collect();
        Curve {
            poke: poke.number,
            time_s: of(&|s| s.time_s),
            depth_m: of(&|s| s.depth_m),
            measured_n: of(&|s| {
                along(s.modelled_n) * relaxed(s.time_s) + along(s.measured_n) - along(s.modelled_n)
            }),
            baseline_n: of(&|s| along(s.modelled_n) * (1.0 - 0.6 * share)),
            extended_n: of(&|s| along(s.modelled_n) * relaxed(s.time_s)),
            markers: (0..60)
                .map(|i| (start + 0.13 * f64::from(i), 1.0 + 6.0 * share, 1.0 + 0.05 * f64::from(i % 3)))
                .collect(),
        }
    };
    fit.pokes.iter().map(curve).collect()
}

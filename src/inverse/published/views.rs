//! The published fit as a person looks at it: every poke's force, and the body at the instant that was used.

use super::bench::PhantomBench;
use super::measure::Measurement;
use super::sprung::Sprung;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::inverse::evidence::Evidence;
use crate::inverse::{InverseError, MarkerView, PokeView, Sample};
use crate::observation::{Poke, Recording};
use nalgebra::DMatrix;

/// One view a measurement. The wrench drives the model: its force is the measured one.
pub(super) fn views(
    recording: &Recording,
    evidence: &Evidence,
    bench: &PhantomBench,
    measured: &[Measurement],
    young_modulus_pa: f64,
    held: &Sprung,
    chi2_per_value: &[f64],
) -> Result<Vec<PokeView>, InverseError> {
    let shares: Vec<_> = measured.iter().map(|m| bench.share(m.site, &m.wrench)).collect();
    let shares = DMatrix::from_columns(&shares);
    let fields = bench.displace(&shares, &(&held.forces * &shares))?;
    let observed = &held.observed * &shares;
    let views = measured.iter().zip(fields).enumerate().map(|(column, (m, field))| {
        let poke = &recording.pokes[m.poke];
        let at = |values: &[f64], i: usize| Vec3::new(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
        let modelled: Vec<f64> = observed.column(column).iter().copied().collect();
        let markers = m.seen.iter().enumerate().map(|(i, &marker)| MarkerView {
            number: recording.markers.numbers[marker],
            rest_m: evidence.rest[marker].0,
            measured_m: at(m.displacement.as_slice(), i),
            modelled_m: at(&modelled, marker),
        });
        PokeView {
            number: poke.number,
            site_m: poke.site,
            direction: poke.direction,
            radius_m: poke.radius_m,
            deepest_s: m.time_s,
            node_displacement_m: (0..field.len() / 3).map(|n| at(&field, n) / young_modulus_pa).collect(),
            markers: markers.collect(),
            samples: samples(recording, poke),
            chi2_per_value: chi2_per_value[m.poke],
        }
    });
    Ok(views.collect())
}

/// Force against time, with the depth where a stage was recorded.
fn samples(recording: &Recording, poke: &Poke) -> Vec<Sample> {
    let wrench = &recording.wrench;
    let stage = recording.stage.as_ref().map(|s| (Rows::new(&s.time_s), &s.displacement_m));
    let depth = |time_s: f64| {
        let (rows, displacement) = stage.as_ref()?;
        let d = rows.at(displacement, time_s, poke.start_s, poke.end_s)?;
        Some(Vec3::from(d).dot(&poke.direction))
    };
    Rows::new(&wrench.time_s)
        .within(poke.start_s, poke.end_s)
        .map(|i| Sample {
            time_s: wrench.time_s[i],
            depth_m: depth(wrench.time_s[i]).unwrap_or(0.0),
            measured_n: wrench.force_n[i],
            modelled_n: wrench.force_n[i],
        })
        .collect()
}

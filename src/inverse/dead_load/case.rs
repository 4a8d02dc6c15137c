//! A recording's load cases: what acted, and where that took the markers.

use super::super::error::InverseError;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::observation::{Poke, Recording};

/// What acts on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadLoad {
    /// Force (N) on the disc.
    pub force_n: Vec3,
    /// Moment (N·m) about the site.
    pub torque_nm: Vec3,
    /// Centre of the disc on the undeformed surface (m).
    pub site: Vec3,
    /// Unit vector into the body there.
    pub direction: Vec3,
    /// Radius of the disc (m).
    pub radius_m: f64,
    /// Weight per undeformed volume (N/m³).
    pub weight_n_m3: Vec3,
}

/// A marker in a load case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaseMarker {
    /// Number by which the recording names it.
    pub number: u32,
    /// Rest position (m).
    pub rest: Vec3,
    /// Mean displacement from there (m); `None` when it was not seen.
    pub moved: Option<Vec3>,
}

/// A load case.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name of the recording.
    pub recording: String,
    /// Number of the poke.
    pub poke: u32,
    /// What acted.
    pub load: DeadLoad,
    /// Markers.
    pub markers: Vec<CaseMarker>,
}

/// A load that scatters by more than so many times its stated noise, and by more than [`STEADY_SHARE`] of itself, is none.
const STEADY_SD: f64 = 5.0;
const STEADY_SHARE: f64 = 0.02;

/// The load case of every poke of `recording`: mean load and mean displacements between its limits.
///
/// # Errors
/// [`InverseError::Unsteady`] for a load that changes during a poke, [`InverseError::SagAtRest`] where rest positions carry the sag,
/// [`InverseError::Nothing`] for a recording without rows in its pokes.
pub fn cases(recording: &Recording) -> Result<Vec<Case>, InverseError> {
    let gravity = recording.phantom.gravity;
    if gravity.is_some_and(|g| g.at_rest) {
        return Err(InverseError::SagAtRest { recording: recording.name.clone() });
    }
    let weight = gravity.map_or_else(Vec3::zeros, |g| g.acceleration_m_s2) * recording.phantom.density_kg_m3;
    recording.pokes.iter().map(|poke| case(recording, poke, weight)).collect()
}

fn case(recording: &Recording, poke: &Poke, weight_n_m3: Vec3) -> Result<Case, InverseError> {
    let wrench = &recording.wrench;
    let rows = Rows::new(&wrench.time_s).within(poke.start_s, poke.end_s);
    let count = rows.len() as f64;
    if rows.is_empty() {
        return Err(InverseError::Nothing { pokes: recording.pokes.len() });
    }
    let mean = |of: &[[f64; 3]]| of[rows.clone()].iter().map(|v| Vec3::from(*v)).sum::<Vec3>() / count;
    let force_n = mean(&wrench.force_n);
    let scatter = (wrench.force_n[rows.clone()].iter().map(|f| (Vec3::from(*f) - force_n).norm_squared()))
        .sum::<f64>()
        / count;
    let noise = Vec3::from(recording.noise.force_n).norm();
    if scatter.sqrt() > (STEADY_SD * noise).max(STEADY_SHARE * force_n.norm()) {
        return Err(InverseError::Unsteady {
            recording: recording.name.clone(),
            poke: poke.number,
            scatter_n: scatter.sqrt(),
            mean_n: force_n.norm(),
        });
    }
    let rest = recording.rest_positions();
    let mut sums = vec![(Vec3::zeros(), 0.0); rest.len()];
    for row in &recording.markers.rows {
        let at_s = recording.markers.frame_time_s[row.frame as usize];
        if (poke.start_s..=poke.end_s).contains(&at_s) {
            let (sum, count) = &mut sums[row.marker as usize];
            *sum += Vec3::from(row.position_m);
            *count += 1.0;
        }
    }
    let markers = (recording.markers.numbers.iter().zip(&rest).zip(&sums))
        .map(|((&number, (rest, _)), (sum, count))| CaseMarker {
            number,
            rest: *rest,
            moved: (*count > 0.0).then(|| sum / *count - rest),
        })
        .collect();
    let load = DeadLoad {
        force_n,
        torque_nm: mean(&wrench.torque_nm),
        site: poke.site,
        direction: poke.direction,
        radius_m: poke.radius_m,
        weight_n_m3,
    };
    Ok(Case { recording: recording.name.clone(), poke: poke.number, load, markers })
}

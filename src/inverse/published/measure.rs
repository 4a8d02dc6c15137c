//! What the published method takes from a recording: one instant a poke, its load and its marker displacements.
//!
//! The instant is that of the frame with the largest load. Where a stage was recorded that is the deepest frame:
//! the largest of many noisy forces is larger than the force was, while the depth's error enters nothing that
//! follows. The load is the wrench at that frame's time; the displacements are those of the markers seen in it.

use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::inverse::evidence::{Drive, DriveTrack, Driven, Evidence};
use crate::observation::{MarkerRow, Recording};
use nalgebra::DVector;

/// One poke at its largest load.
#[derive(Debug, Clone)]
pub(super) struct Measurement {
    /// Index of the poke in the recording.
    pub(super) poke: usize,
    /// Index of its site in the evidence.
    pub(super) site: usize,
    /// The instant (s).
    pub(super) time_s: f64,
    /// The wrench (N, N·m) and the constant on which weight acts.
    pub(super) wrench: Drive,
    /// Markers seen, as indices among the recording's.
    pub(super) seen: Vec<usize>,
    /// Their displacements (3 a marker, m).
    pub(super) displacement: DVector<f64>,
    /// Norm of the error expected in them (m), the rest means' included.
    pub(super) error_m: f64,
}

/// One measurement a poke in the recording's order; pokes without a frame in which markers and wrench are known
/// are left out.
pub(super) fn measurements(recording: &Recording, evidence: &Evidence) -> Vec<Measurement> {
    let wrench = DriveTrack::new(recording, Driven::ByWrench, &evidence.lifts, &evidence.noise);
    let mut found: Vec<Measurement> = evidence
        .sites
        .iter()
        .enumerate()
        .flat_map(|(site, s)| s.pokes.iter().map(move |&poke| (site, poke)))
        .filter_map(|(site, poke)| measure(recording, evidence, &wrench, site, poke))
        .collect();
    found.sort_by_key(|m| m.poke);
    found
}

fn measure(
    recording: &Recording,
    evidence: &Evidence,
    wrench: &DriveTrack<'_>,
    site: usize,
    poke: usize,
) -> Option<Measurement> {
    let limits = &recording.pokes[poke];
    let times = &recording.markers.frame_time_s;
    let stage = recording.stage.as_ref().map(|s| (Rows::new(&s.time_s), &s.displacement_m));
    // How large the load is: by depth (m) where a stage was recorded, else by force (N).
    let load = |at_s: f64| {
        let force = wrench.at(at_s, poke)?.x;
        let Some((rows, displacement)) = &stage else { return Some(force.fixed_rows::<3>(0).norm()) };
        let depth = rows.at(displacement, at_s, limits.start_s, limits.end_s)?;
        Some(Vec3::from(depth).dot(&limits.direction))
    };
    let (frame, _) = Rows::new(times)
        .within(limits.start_s, limits.end_s)
        .filter_map(|frame| Some((frame, load(times[frame])?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let rows = &recording.markers.rows;
    let first = rows.partition_point(|r| (r.frame as usize) < frame);
    let rows: Vec<_> = rows[first..].iter().take_while(|r| r.frame as usize == frame).collect();
    let seen: Vec<usize> = rows.iter().map(|r| r.marker as usize).collect();
    let moved =
        |r: &&MarkerRow| <[f64; 3]>::from(Vec3::from(r.position_m) - evidence.rest[r.marker as usize].0);
    if seen.is_empty() {
        return None;
    }
    let squares: f64 = evidence.noise.marker_m.iter().map(|sd| sd * sd).sum();
    let error2: f64 = seen.iter().map(|&m| squares * (1.0 + 1.0 / evidence.rest[m].1.max(1) as f64)).sum();
    Some(Measurement {
        poke,
        site,
        time_s: times[frame],
        wrench: wrench.at(times[frame], poke)?.x,
        displacement: DVector::from_iterator(3 * seen.len(), rows.iter().flat_map(moved)),
        error_m: error2.sqrt(),
        seen,
    })
}

//! Which dots are markers: those on the phantom's observed surface. Their paths in the phantom frame.

use super::{Followed, RestingDot};
use crate::calib::Registration;
use crate::device::{MarkerFrame, MarkerPosition};
use crate::geometry::Vec3;
use crate::mesh::{SurfaceIndex, TetMesh};
use std::collections::BTreeMap;

/// Markers of a recording, and how they came to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Attached {
    /// For each stretch of the session, its frames in the phantom frame.
    pub segments: Vec<Vec<MarkerFrame>>,
    /// Dots of the reference that became markers.
    pub markers: Vec<usize>,
    /// The number of each marker: that of its dot, or the one that an earlier session gave it.
    pub numbers: Vec<u32>,
    /// Where each rests, in the phantom frame (m).
    pub rest_m: Vec<Vec3>,
    /// Distance of each from the observed surface (m).
    pub standoff_m: Vec<f64>,
    /// Dots at rest elsewhere: on the bench, on the tip, or on the phantom's sides.
    pub elsewhere: usize,
    /// Beats of the camera for which no frame came; none where it keeps no beat.
    pub missing_on_beat: Option<u64>,
}

/// Attaches dots to the mesh's surface `observed`: those that rest within `most_m` of it (m) and are none of the points `known_m`
/// (phantom frame) that the bench has for registering, within the same distance.
pub fn attach_dots(
    followed: &Followed,
    resting: &[RestingDot],
    registration: &Registration,
    mesh: &TetMesh,
    known_m: &[Vec3],
    most_m: f64,
) -> Attached {
    let surface = SurfaceIndex::new(mesh, mesh.surface("observed"));
    let (mut markers, mut rest, mut standoff_m) = (Vec::new(), Vec::new(), Vec::new());
    for dot in resting {
        let rest_m = registration.apply(&dot.mean_m);
        let fiducial = known_m.iter().any(|known| (known - rest_m).norm() <= most_m);
        let distance_m = surface.nearest(&rest_m).map(|foot| foot.distance_m);
        if let Some(distance_m) = distance_m.filter(|d| *d <= most_m && !fiducial) {
            markers.push(dot.dot);
            rest.push(rest_m);
            standoff_m.push(distance_m);
        }
    }
    let last = followed.frames.last().map_or(0, |frame| frame.segment as usize);
    let mut segments: Vec<Vec<MarkerFrame>> = vec![Vec::new(); last];
    for frame in &followed.frames {
        let seen = markers.iter().filter_map(|&dot| {
            let place = frame.places[dot].as_ref()?;
            // Dots of a picture are far fewer than 2³².
            let position_m = registration.apply(&place.position_m).into();
            Some(MarkerPosition { marker: dot as u32, position_m })
        });
        let markers = seen.collect();
        segments[frame.segment as usize - 1].push(MarkerFrame {
            host: frame.host,
            number: frame.number,
            markers,
        });
    }
    // Dots of a picture are far fewer than 2³².
    let numbers = markers.iter().map(|dot| *dot as u32).collect();
    Attached {
        elsewhere: resting.len() - markers.len(),
        missing_on_beat: followed.counts.missing_on_beat,
        segments,
        markers,
        numbers,
        rest_m: rest,
        standoff_m,
    }
}

impl Attached {
    /// Gives every marker the number of that of an earlier session which rests within `most_m` of it (m), and those that rest elsewhere new
    /// ones: each session has a reference picture of its own.
    pub fn number_after(&mut self, earlier: &Attached, most_m: f64) {
        let mut free = earlier.numbers.iter().max().map_or(0, |most| most + 1);
        let mut named = vec![false; earlier.numbers.len()];
        let before = std::mem::take(&mut self.numbers);
        for rest in &self.rest_m {
            let nearest = (earlier.rest_m.iter().enumerate())
                .filter(|(i, _)| !named[*i])
                .map(|(i, place)| (i, (place - rest).norm()))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, distance)| *distance <= most_m);
            self.numbers.push(match nearest {
                Some((i, _)) => {
                    named[i] = true;
                    earlier.numbers[i]
                }
                None => {
                    free += 1;
                    free - 1
                }
            });
        }
        let renamed: BTreeMap<u32, u32> = before.into_iter().zip(self.numbers.iter().copied()).collect();
        for frame in self.segments.iter_mut().flatten() {
            for marker in &mut frame.markers {
                marker.marker = renamed[&marker.marker];
            }
            frame.markers.sort_by_key(|marker| marker.marker);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::HostTime;

    fn attached(rest_mm: &[[f64; 2]]) -> Attached {
        let place = |at: &[f64; 2]| Vec3::new(at[0] * 1e-3, at[1] * 1e-3, 0.025);
        let markers = (0..rest_mm.len())
            .map(|m| MarkerPosition { marker: m as u32, position_m: place(&rest_mm[m]).into() })
            .collect();
        Attached {
            segments: vec![vec![MarkerFrame { host: HostTime::from_nanos(1), number: 0, markers }]],
            markers: (0..rest_mm.len()).collect(),
            numbers: (0..rest_mm.len() as u32).collect(),
            rest_m: rest_mm.iter().map(place).collect(),
            standoff_m: vec![0.0; rest_mm.len()],
            elsewhere: 0,
            missing_on_beat: None,
        }
    }

    #[test]
    fn a_marker_keeps_its_number_from_session_to_session() {
        let first = attached(&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]]);
        let mut second = attached(&[[20.3, 0.1], [30.0, 0.0], [0.1, 0.0]]);
        second.number_after(&first, 1e-3);
        assert_eq!(second.numbers, [2, 3, 0]);
        let seen: Vec<(u32, f64)> = second.segments[0][0]
            .markers
            .iter()
            .map(|m| (m.marker, (m.position_m[0] * 1e4).round()))
            .collect();
        assert_eq!(seen, [(0, 1.0), (2, 203.0), (3, 300.0)]);
    }
}

//! What is in a recording: sizes, pokes with their depth and force ranges, sampling rates, gaps, occlusion.
//!
//! A survey is for people and for `--json`: its fields carry their units in their names.

use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::observation::{Poke, Recording};
use serde::Serialize;
use std::collections::BTreeMap;

/// A gap is a spacing longer than this many median spacings; no value is interpolated across it.
const GAP_SPACINGS: f64 = 5.0;

/// A channel keeps a rate when this share of its spacings differs by less than that share from the median.
const STEADY: f64 = 0.8;
const OFF_TIME: f64 = 0.25;

/// What is in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// Size of the body.
    pub mesh: MeshSurvey,
    /// One entry a poke, in order of time.
    pub pokes: Vec<PokeSurvey>,
    /// Rows of `stage.csv`, when there is one.
    pub stage: Option<ChannelSurvey>,
    /// Rows of `force.csv`.
    pub force: ChannelSurvey,
    /// Frames of `markers.csv`.
    pub frames: ChannelSurvey,
    /// Who was seen how often.
    pub markers: MarkerSurvey,
}

/// Size of the mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshSurvey {
    /// Nodes.
    pub nodes: usize,
    /// Tetrahedra.
    pub tetrahedra: usize,
    /// Volume (m³).
    pub volume_m3: f64,
    /// Edges of the bounding box (m).
    pub extent_m: [f64; 3],
    /// Named surfaces.
    pub surfaces: BTreeMap<String, SurfaceSurvey>,
}

/// Size of a named surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SurfaceSurvey {
    /// Triangles.
    pub triangles: usize,
    /// Area (m²).
    pub area_m2: f64,
}

/// One poke.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PokeSurvey {
    /// Its number.
    pub poke: u32,
    /// Tip centre (m).
    pub site_m: [f64; 3],
    /// Unit vector into the phantom.
    pub direction: [f64; 3],
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// First instant of contact (s).
    pub start_s: f64,
    /// Last instant of contact (s).
    pub end_s: f64,
    /// Smallest and largest displacement of the stage along the direction (m).
    pub depth_m: Option<[f64; 2]>,
    /// Smallest and largest force along the direction (N).
    pub force_n: Option<[f64; 2]>,
    /// Rows of `force.csv` in the poke.
    pub force_rows: usize,
    /// Frames of `markers.csv` in the poke.
    pub frames: usize,
}

/// How a channel was sampled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChannelSurvey {
    /// Instants with a row.
    pub rows: usize,
    /// One over the median spacing (Hz); `None` with fewer than two rows.
    pub rate_hz: Option<f64>,
    /// Spacings inside pokes across which no value may be interpolated.
    pub gaps_in_pokes: usize,
    /// Longest spacing inside a poke (s).
    pub longest_spacing_in_pokes_s: f64,
    /// Instants that are missing inside pokes; `None` of a channel that keeps no rate.
    pub missing_in_pokes: Option<usize>,
}

/// How often markers were seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MarkerSurvey {
    /// Markers that were seen at all.
    pub markers: usize,
    /// Rows.
    pub rows: usize,
    /// Frames before the end of the rest interval.
    pub rest_frames: usize,
    /// Fewest rows from which a marker's rest position is taken.
    pub fewest_rest_rows: usize,
    /// Share of the frames, over all markers, in which a marker has no row.
    pub occluded: f64,
    /// The marker that is missing most often.
    pub worst_marker: u32,
    /// Share of the frames in which it has no row.
    pub worst_occluded: f64,
}

/// Surveys a checked recording.
pub fn survey(recording: &Recording) -> Survey {
    let stage = recording.stage.as_ref().map(|s| channel(&s.time_s, &recording.pokes));
    Survey {
        mesh: mesh(recording),
        pokes: recording.pokes.iter().map(|p| poke(recording, p)).collect(),
        stage,
        force: channel(&recording.wrench.time_s, &recording.pokes),
        frames: channel(&recording.markers.frame_time_s, &recording.pokes),
        markers: markers(recording),
    }
}

fn mesh(recording: &Recording) -> MeshSurvey {
    let mesh = &recording.mesh;
    let low = mesh.nodes.iter().fold(Vec3::from_element(f64::INFINITY), |a, p| a.inf(p));
    let high = mesh.nodes.iter().fold(Vec3::from_element(f64::NEG_INFINITY), |a, p| a.sup(p));
    let surface = |(name, faces): (&String, &Vec<[u32; 3]>)| {
        let area_m2 = faces.iter().map(|&f| mesh.triangle(f).area()).sum();
        (name.clone(), SurfaceSurvey { triangles: faces.len(), area_m2 })
    };
    MeshSurvey {
        nodes: mesh.nodes.len(),
        tetrahedra: mesh.tets.len(),
        volume_m3: mesh.volume(),
        extent_m: (high - low).into(),
        surfaces: mesh.surfaces.iter().map(surface).collect(),
    }
}

fn poke(recording: &Recording, poke: &Poke) -> PokeSurvey {
    let along = |time_s: &[f64], rows: &[[f64; 3]]| {
        let inside = Rows::new(time_s).within(poke.start_s, poke.end_s);
        let values = rows[inside].iter().map(|r| Vec3::from(*r).dot(&poke.direction));
        let range = |r: Option<[f64; 2]>, v: f64| Some(r.map_or([v, v], |[a, b]| [a.min(v), b.max(v)]));
        values.fold(None, range)
    };
    let count = |time_s: &[f64]| Rows::new(time_s).within(poke.start_s, poke.end_s).len();
    PokeSurvey {
        poke: poke.number,
        site_m: poke.site.into(),
        direction: poke.direction.into(),
        radius_m: poke.radius_m,
        start_s: poke.start_s,
        end_s: poke.end_s,
        depth_m: recording.stage.as_ref().and_then(|s| along(&s.time_s, &s.displacement_m)),
        force_n: along(&recording.wrench.time_s, &recording.wrench.force_n),
        force_rows: count(&recording.wrench.time_s),
        frames: count(&recording.markers.frame_time_s),
    }
}

fn channel(time_s: &[f64], pokes: &[Poke]) -> ChannelSurvey {
    let mut spacing: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    spacing.sort_by(f64::total_cmp);
    let median = spacing.get(spacing.len() / 2).copied();
    let rows = Rows::new(time_s);
    let inside = pokes.iter().flat_map(|p| time_s[rows.within(p.start_s, p.end_s)].windows(2));
    let (mut gaps_in_pokes, mut longest_spacing_in_pokes_s, mut missing) = (0, 0.0_f64, 0);
    for pair in inside {
        let spacing = pair[1] - pair[0];
        longest_spacing_in_pokes_s = longest_spacing_in_pokes_s.max(spacing);
        gaps_in_pokes += usize::from(median.is_some_and(|m| spacing > GAP_SPACINGS * m));
        missing += median.map_or(0, |m| (spacing / m).round() as usize).saturating_sub(1);
    }
    let on_time = |m: f64| spacing.iter().filter(|s| (*s / m - 1.0).abs() < OFF_TIME).count();
    let keeps_a_rate = median.is_some_and(|m| on_time(m) as f64 > STEADY * spacing.len() as f64);
    ChannelSurvey {
        rows: time_s.len(),
        rate_hz: median.map(|m| 1.0 / m),
        gaps_in_pokes,
        longest_spacing_in_pokes_s,
        missing_in_pokes: keeps_a_rate.then_some(missing),
    }
}

fn markers(recording: &Recording) -> MarkerSurvey {
    let markers = &recording.markers;
    let mut seen = vec![0_usize; markers.numbers.len()];
    for row in &markers.rows {
        seen[row.marker as usize] += 1;
    }
    let frames = markers.frame_time_s.len();
    let share = |missing: usize, of: usize| missing as f64 / of.max(1) as f64;
    let (worst, fewest) =
        seen.iter().copied().enumerate().min_by_key(|&(_, count)| count).unwrap_or((0, frames));
    MarkerSurvey {
        markers: markers.numbers.len(),
        rows: markers.rows.len(),
        rest_frames: markers.frame_time_s.partition_point(|&t| t < recording.rest_until_s),
        fewest_rest_rows: recording.rest_positions().iter().map(|r| r.1).min().unwrap_or(0),
        occluded: share(frames * seen.len() - markers.rows.len(), frames * seen.len()),
        worst_marker: markers.numbers.get(worst).copied().unwrap_or(0),
        worst_occluded: share(frames - fewest, frames),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn nothing_is_missing_of_a_channel_that_keeps_no_rate() {
        let pokes = [Poke {
            number: 1,
            site: Vec3::zeros(),
            direction: Vec3::z(),
            radius_m: 0.005,
            start_s: 0.0,
            end_s: 10.0,
        }];
        let beat = |n: u32| f64::from(n) * 0.1;
        let missing = |time_s: Vec<f64>| channel(&time_s, &pokes).missing_in_pokes;
        assert_eq!(missing((0..100).map(beat).collect()), Some(0));
        assert_eq!(missing((0..100).filter(|n| ![40, 60, 61].contains(n)).map(beat).collect()), Some(3));
        // Reports that come in pairs, with a pause of three times as long between.
        assert_eq!(missing((0..100).filter(|n| n % 4 < 2).map(beat).collect()), None);
        assert_eq!(missing(vec![1.0]), None);
    }
}

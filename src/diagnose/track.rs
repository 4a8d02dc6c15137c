//! What was recorded of every poke, row by row, and the motion that the stage reported, its noise taken off.

use super::motion::without_noise;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::inverse::{DriveTrack, Evidence};
use crate::observation::Recording;

/// One poke.
#[derive(Debug, Clone)]
pub(super) struct Track {
    /// Number by which the recording names the poke.
    pub number: u32,
    /// Its own among the tracks.
    pub index: usize,
    /// Index of its site in the evidence.
    pub site: usize,
    /// Unit vector of the poke.
    pub direction: Vec3,
    /// Unit normal of the surface, into the phantom.
    pub inward: Vec3,
    /// Time of every row of the force sensor inside the poke (s).
    pub time_s: Vec<f64>,
    /// Displacement that the stage reports there (m).
    pub reported_m: Vec<Vec3>,
    /// Force read (N).
    pub force_n: Vec<Vec3>,
    /// Depth that the stage reports along the poke (m).
    pub depth_m: Vec<f64>,
    /// Whether a fit goes by the row: the first and last moments of contact it leaves out.
    pub counts: Vec<bool>,
    /// Frames of the camera inside the poke.
    pub frames: Vec<Frame>,
    /// Row of the timeline at which it begins.
    pub first_row: usize,
}

/// All rows of the recording in time, as far as they set the phantom in motion.
#[derive(Debug, Clone)]
pub(super) struct Timeline {
    pub rows: Vec<Row>,
    /// How deep the tip went at every site before (m); empty: nowhere.
    pub deepest_m: Vec<f64>,
}

/// One row of the timeline.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Its time (s).
    pub time_s: f64,
    /// The tip, while it touches.
    pub contact: Option<Touch>,
    /// Whether a poke begins here.
    pub first: bool,
}

/// A tip that touches.
#[derive(Debug, Clone)]
pub(super) struct Touch {
    /// Index of the site in the evidence.
    pub site: usize,
    /// Unit vector of the poke.
    pub direction: Vec3,
    /// Unit normal of the surface, into the phantom.
    pub inward: Vec3,
    /// Displacement that the stage reports (m).
    pub reported_m: Vec3,
}

/// The rows of all pokes, and between them those of the force sensor, every few: there everything only creeps.
pub(super) fn timeline(recording: &Recording, tracks: &mut [Track]) -> Timeline {
    const EVERY: usize = 5;
    let mut rows = Vec::new();
    let mut done_s = f64::NEG_INFINITY;
    for track in tracks {
        let (Some(&start), Some(&end)) = (track.time_s.first(), track.time_s.last()) else { continue };
        let between = recording.wrench.time_s.iter().filter(|t| **t > done_s && **t < start);
        rows.extend(between.step_by(EVERY).map(|&time_s| Row { time_s, contact: None, first: false }));
        track.first_row = rows.len();
        for (i, (&time_s, &reported_m)) in track.time_s.iter().zip(&track.reported_m).enumerate() {
            let contact = Some(Touch {
                site: track.site,
                direction: track.direction,
                inward: track.inward,
                reported_m,
            });
            rows.push(Row { time_s, contact, first: i == 0 });
        }
        done_s = end;
    }
    Timeline { rows, deepest_m: Vec::new() }
}

/// One frame of the camera.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    /// Its stamp (s).
    pub time_s: f64,
    /// Markers seen: index, and displacement from the rest position (m).
    pub seen: Vec<(usize, Vec3)>,
}

/// A fit goes by the rows beyond this share of the poke's depth. How contact begins and ends, which no model here
/// describes, shows in the others.
pub(super) const LEAST_DEPTH: f64 = 0.05;

impl Frame {
    /// Indices of the markers seen.
    pub(super) fn markers(&self) -> impl Iterator<Item = usize> + '_ {
        self.seen.iter().map(|(marker, _)| *marker)
    }
}

impl Track {
    /// Whether a fit goes by what is seen at this time (s).
    pub(super) fn counts_at(&self, time_s: f64) -> bool {
        let right = self.time_s.partition_point(|t| *t < time_s);
        let near = right.saturating_sub(1)..(right + 1).min(self.counts.len());
        !near.is_empty() && self.counts[near].iter().all(|c| *c)
    }
}

/// Every poke of a recording, in order.
/// `inward` holds the surface's normal at every site.
pub(super) fn tracks(recording: &Recording, evidence: &Evidence, inward: &[Vec3]) -> Vec<Track> {
    let drive = DriveTrack::new(recording, evidence.driven, &evidence.lifts, &evidence.noise);
    let site_of = |poke: usize| evidence.sites.iter().position(|site| site.pokes.contains(&poke));
    let pokes = recording.pokes.iter().enumerate();
    let mut tracks: Vec<Track> = pokes
        .filter_map(|(index, poke)| {
            let rows = Rows::new(&recording.wrench.time_s).within(poke.start_s, poke.end_s);
            let (mut time_s, mut noisy, mut force_n) = (Vec::new(), Vec::new(), Vec::new());
            for row in rows {
                let t = recording.wrench.time_s[row];
                if let Some(driving) = drive.at(t, index) {
                    time_s.push(t);
                    noisy.push(driving.x.fixed_rows::<3>(0).into_owned());
                    force_n.push(Vec3::from(recording.wrench.force_n[row]));
                }
            }
            let mut frames: Vec<Frame> = Vec::new();
            for (row, _) in drive.marker_rows(index) {
                let t = recording.markers.frame_time_s[row.frame as usize];
                if frames.last().is_none_or(|f| f.time_s != t) {
                    frames.push(Frame { time_s: t, seen: Vec::new() });
                }
                let marker = row.marker as usize;
                let moved = Vec3::from(row.position_m) - evidence.rest[marker].0;
                if let Some(frame) = frames.last_mut() {
                    frame.seen.push((marker, moved));
                }
            }
            let reported_m = without_noise(&time_s, &noisy, evidence.noise.stage_m);
            let site = site_of(index)?;
            let direction = poke.direction;
            let depth_m: Vec<f64> = reported_m.iter().map(|x| x.dot(&direction)).collect();
            let least = LEAST_DEPTH * depth_m.iter().copied().fold(0.0, f64::max);
            let counts = depth_m.iter().map(|depth| *depth >= least).collect();
            Some(Track {
                number: poke.number,
                index: 0,
                site,
                direction,
                inward: inward[site],
                time_s,
                reported_m,
                force_n,
                depth_m,
                counts,
                frames,
                first_row: 0,
            })
        })
        .filter(|track| track.time_s.len() > 1)
        .collect();
    tracks.iter_mut().enumerate().for_each(|(i, track)| track.index = i);
    tracks
}

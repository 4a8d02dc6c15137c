//! The recording as it would have been without what acts, so that the restraint can be looked for once more.
//!
//! The default fit looks for the restraint in a recording that something unknown has changed, and may find patches that stand for that. What a
//! reading adds to the baseline's prediction is taken off every row of a poke; the noise stays.

use super::model::{Acting, Model};
use super::refit::Fitted;
use super::select::reduced;
use crate::observation::Recording;
use std::collections::HashMap;

impl Model<'_> {
    /// The recording without the effects of a reading. `None` where the model has no answer.
    pub(super) fn cleared(&self, fitted: &Fitted) -> Option<Recording> {
        let (without, at) = reduced(self, fitted, |_| false);
        let without = Acting { fine: false, ..without };
        let marched = [self.march(&fitted.acting, &fitted.at)?, self.march(&without, &at)?];
        let parameters = [&fitted.at, &at];
        let mut recording = self.settled.recording.clone();
        let mut moved: HashMap<(u32, u32), [f64; 3]> = HashMap::new();
        for track in &self.tracks {
            let share = |which: usize, channel: usize| {
                parameters[which][marched[which].fitted + channel * self.body.sites + track.site]
            };
            for counts in [true, false] {
                let left = [0, 1].map(|w| self.force_rows(track, &marched[w], share(w, 0), counts));
                let rows = (0..track.time_s.len()).filter(|&i| track.counts[i] == counts);
                for (n, row) in rows.enumerate() {
                    let of_recording = recording.wrench.time_s.partition_point(|t| *t < track.time_s[row]);
                    for axis in 0..3 {
                        let [with, without] = [0, 1].map(|w| left[w][(3 * n + axis, marched[w].fitted + 1)]);
                        recording.wrench.force_n[of_recording][axis] +=
                            (with - without) * self.force_sd[axis];
                    }
                }
            }
            for frame in &track.frames {
                let left = [0, 1].map(|w| self.marker_rows_as_seen(track, frame, &marched[w], share(w, 1)));
                let [Some(with), Some(without)] = left else { continue };
                let times = &recording.markers.frame_time_s;
                let of_recording = times.partition_point(|t| *t < frame.time_s) as u32;
                for (n, (marker, _)) in frame.seen.iter().enumerate() {
                    let by = |axis: usize| {
                        let row = 3 * n + axis;
                        (with[(row, marched[0].fitted + 1)] - without[(row, marched[1].fitted + 1)])
                            * self.marker_sd[*marker][axis]
                    };
                    moved.insert((of_recording, *marker as u32), [0, 1, 2].map(by));
                }
            }
        }
        for row in &mut recording.markers.rows {
            if let Some(by) = moved.get(&(row.frame, row.marker)) {
                row.position_m.iter_mut().zip(by).for_each(|(x, by)| *x += by);
            }
        }
        Some(recording)
    }
}

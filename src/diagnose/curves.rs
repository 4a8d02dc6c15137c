//! Every poke as fits to the other pokes predict it: what a person looks at.

use super::diagnosis::Curve;
use super::model::Model;
use super::refit::Fitted;
use super::track::Frame;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// One poke predicted: force along the poke (N) row by row, and root mean square of the markers' misfit over noise of
/// every frame.
struct Predicted {
    force_n: Vec<f64>,
    markers: Vec<f64>,
}

/// All pokes, by the baseline and by the reading chosen, each with the model that it is one of.
pub(super) fn curves(baseline: (&Model<'_>, &Fitted), extended: (&Model<'_>, &Fitted)) -> Vec<Curve> {
    let model = baseline.0;
    (0..model.tracks.len())
        .into_par_iter()
        .filter_map(|poke| {
            let track = &model.tracks[poke];
            let (before, after) = (predicted(baseline, poke)?, predicted(extended, poke)?);
            let frames = track.frames.iter().zip(before.markers.iter().zip(&after.markers));
            Some(Curve {
                poke: track.number,
                time_s: track.time_s.clone(),
                depth_m: track.depth_m.clone(),
                measured_n: track.force_n.iter().map(|f| f.dot(&track.direction)).collect(),
                baseline_n: before.force_n,
                extended_n: after.force_n,
                markers: frames.map(|(frame, (b, a))| (frame.time_s, *b, *a)).collect(),
            })
        })
        .collect()
}

fn predicted((model, fitted): (&Model<'_>, &Fitted), poke: usize) -> Option<Predicted> {
    let at = fitted.without(model, poke)?;
    let marched = model.march_near(fitted, &fitted.acting, &at)?;
    let track = &model.tracks[poke];
    let share = |channel: usize| at[marched.fitted + channel * model.body.sites + track.site];
    let rms = |frame: &Frame, rows: &DMatrix<f64>| {
        (model.stated_chi2(frame, rows) / rows.nrows().max(1) as f64).sqrt()
    };
    let markers = track.frames.iter().map(|frame| {
        model.marker_rows(track, frame, &marched, share(1)).map_or(f64::NAN, |rows| rms(frame, &rows))
    });
    let markers = markers.collect();
    let force_n = (0..track.time_s.len())
        .map(|row| {
            let felt = model.felt_at(track, &marched, row);
            (0..3)
                .map(|axis| {
                    let (of_tip, besides) = felt[axis];
                    (of_tip.re * (1.0 + share(0)) + besides.re) * track.direction[axis]
                })
                .sum()
        })
        .collect();
    Some(Predicted { force_n, markers })
}

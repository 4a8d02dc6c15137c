//! Dots are alike: what differs much from the dots around it in size or brightness is a glint or a scratch.
//!
//! Compared are neighbours only, so that perspective, tilt and uneven light do not count. Medians bear up to half of strangers.

use crate::track::Dot;

/// Neighbours that a dot is compared with.
const NEIGHBOURS: usize = 8;
/// A dot alone, or nearly so, has nothing to be compared with.
const LEAST_NEIGHBOURS: usize = 4;
/// Bounds of the area over the neighbours' median area.
const AREA: [f64; 2] = [0.5, 2.0];
/// Least contrast over the neighbours' median contrast.
const CONTRAST: f64 = 0.3;
/// Most blur: twice the neighbours' median and half a pixel, for dots side by side are as sharp as one another.
const SHARPNESS: [f64; 2] = [2.0, 0.5];
/// Most blur over radius: a glow has no rim.
const BLUR: f64 = 0.5;
/// Least share of the variance that a blurred disc must explain.
const QUALITY: f64 = 0.8;

/// Most background over the neighbours' median background, in their median contrast, of what a disc explains no better than so: a lamp's
/// image in wet skin or in a rim lies on a glow, and is ragged. A dot in a glare lies on one too, but is a disc still.
const GLOW: (f64, f64) = (0.25, 0.95);

/// Keeps what looks like a dot and like its neighbours.
pub(super) fn keep_alike(dots: Vec<Dot>) -> Vec<Dot> {
    let dots: Vec<Dot> = dots
        .into_iter()
        .filter(|d| d.border || d.blur_px.is_none_or(|b| d.quality >= QUALITY && b <= BLUR * d.radius_px()))
        .collect();
    let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(dots.len());
    let alike: Vec<bool> = (0..dots.len())
        .map(|i| {
            nearest.clear();
            nearest.extend(
                dots.iter().enumerate().filter(|&(j, _)| j != i).map(|(j, d)| (d.distance_px(&dots[i]), j)),
            );
            if nearest.len() < LEAST_NEIGHBOURS {
                return true;
            }
            let count = NEIGHBOURS.min(nearest.len());
            nearest.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
            let area = |d: &Dot| d.rim_px.determinant();
            let typical_area = median(nearest[..count].iter().map(|&(_, j)| area(&dots[j])));
            let typical_contrast = median(nearest[..count].iter().map(|&(_, j)| dots[j].contrast));
            let typical_blur = median(nearest[..count].iter().map(|&(_, j)| dots[j].blur_px.unwrap_or(0.0)));
            let typical_background = median(nearest[..count].iter().map(|&(_, j)| dots[j].background));
            let raised = dots[i].background - typical_background > GLOW.0 * typical_contrast;
            let glow = raised && (dots[i].blur_px.is_none() || dots[i].quality < GLOW.1);
            let sharp = dots[i].blur_px.is_none_or(|b| b <= SHARPNESS[0] * typical_blur + SHARPNESS[1]);
            let size = area(&dots[i]) / typical_area;
            // A dot cut by the border may be smaller than the others.
            let small = size < AREA[0] && !dots[i].border;
            sharp && !glow && !small && size <= AREA[1] && dots[i].contrast >= CONTRAST * typical_contrast
        })
        .collect();
    dots.into_iter().zip(alike).filter(|&(_, alike)| alike).map(|(dot, _)| dot).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

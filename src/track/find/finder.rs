//! One picture from its levels to the dots that are alike.

use super::candidates::{Candidate, Search};
use super::threshold::Levels;
use super::{noise, population, runs};
use crate::track::centre::{Refiner, Rough};
use crate::track::{Dot, DotSettings, GreyView};

/// What a picture holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The dots, from the top to the bottom of the picture.
    pub dots: Vec<Dot>,
    /// Standard deviation of the picture's noise (grey levels), rounding included.
    pub noise: f64,
}

/// Candidates beyond this number are noise, not dots.
const MOST_CANDIDATES: usize = 4000;

/// How far beyond a rim the background is looked at (px): at most, and at least where dots are close together.
const MARGIN: [f64; 2] = [2.5, 5.0];

/// A share of white pixels from which a dot counts as saturated.
const WHITE_SHARE: f64 = 0.2;

/// Finds dots in one picture after another, reusing memory.
#[derive(Default)]
pub struct Finder {
    refiner: Refiner,
}

impl Finder {
    /// All dots of a picture.
    pub fn find(&mut self, view: &GreyView<'_>, settings: &DotSettings) -> Found {
        let noise = noise::noise(view);
        let levels = Levels::of(view, settings.radius_px[1], noise, settings.least_contrast);
        let runs = runs::runs_above(view, &levels);
        let least_height = settings.least_contrast * noise;
        let mut search = Search { view, settings, least_height, found: Vec::new() };
        search.all(&runs, &levels);
        let mut candidates = search.found;
        if candidates.len() > MOST_CANDIDATES {
            candidates.sort_by(|a, b| (b.top - b.base).total_cmp(&(a.top - a.base)));
            candidates.truncate(MOST_CANDIDATES);
        }
        candidates.sort_by(|a, b| a.shape.centre.y.total_cmp(&b.shape.centre.y));
        let gaps = gaps(&candidates);
        let dots = candidates
            .iter()
            .zip(gaps)
            .filter_map(|(candidate, gap)| self.measure(view, candidate, gap, noise, settings))
            .collect();
        Found { dots: population::keep_alike(dots), noise }
    }

    fn measure(
        &mut self,
        view: &GreyView<'_>,
        candidate: &Candidate,
        gap: f64,
        noise: f64,
        settings: &DotSettings,
    ) -> Option<Dot> {
        let rough = Rough {
            centre: candidate.shape.centre,
            moments: candidate.shape.moments,
            base: candidate.base,
            top: candidate.top,
            margin: (0.5 * gap).clamp(MARGIN[0], MARGIN[1]),
        };
        let fine = self.refiner.refine(view, &rough, noise)?;
        let dot = Dot {
            centre_px: fine.centre.into(),
            covariance_px2: fine.covariance,
            light: fine.light,
            rim_px: fine.rim,
            contrast: fine.height,
            background: fine.base,
            blur_px: fine.blur,
            quality: fine.explained,
            saturated: fine.white >= WHITE_SHARE,
            border: candidate.border,
            merged: candidate.merged,
        };
        let [least, most] = settings.radius_px;
        let sized = (least..=most).contains(&dot.longest_px()) || dot.border;
        (sized && dot.contrast >= settings.least_contrast * noise).then_some(dot)
    }
}

/// Distance from each candidate's rim to that of the nearest other one (px). Candidates are ordered by y, so that far ones end the search.
fn gaps(candidates: &[Candidate]) -> Vec<f64> {
    let radius = |c: &Candidate| (c.shape.area / std::f64::consts::PI).sqrt();
    let widest = candidates.iter().map(radius).fold(0.0, f64::max);
    let mut gaps = vec![f64::INFINITY; candidates.len()];
    for (i, a) in candidates.iter().enumerate() {
        for (j, b) in candidates.iter().enumerate().skip(i + 1) {
            if b.shape.centre.y - a.shape.centre.y > 2.0 * (widest + MARGIN[1]) {
                break;
            }
            let gap = (a.shape.centre - b.shape.centre).norm() - radius(a) - radius(b);
            gaps[i] = gaps[i].min(gap);
            gaps[j] = gaps[j].min(gap);
        }
    }
    gaps
}

//! How the dots lie to one another before anything moves: neighbours, spacings, triangles.

use super::triangulation::Triangulation;
use crate::track::TrackError;
use nalgebra::Vector2;

/// Fewest dots that tell one another apart.
const LEAST_DOTS: usize = 6;
/// Most dots.
const MOST_DOTS: usize = 1000;
/// Edges longer than this many spacings join dots across a gap or along the hull: no neighbours.
const LONGEST_EDGE: f64 = 2.3;
/// Neighbours that predict a dot: the nearest of its neighbours and theirs.
const SUPPORT: usize = 12;

/// The reference dots and their neighbourhoods.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    /// Places (px).
    pub(super) places: Vec<Vector2<f64>>,
    /// Distance to the nearest neighbours (px): the median of the three shortest edges.
    pub(super) spacing: Vec<f64>,
    /// Dots that predict each dot, the nearest first.
    pub(super) support: Vec<Vec<usize>>,
    /// Delaunay triangles with sound edges, positively oriented.
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Reference {
    /// Checks the dots and finds out who is next to whom.
    ///
    /// # Errors
    /// [`TrackError`]: too few dots, too many, or two in one place.
    pub(super) fn new(places: Vec<Vector2<f64>>) -> Result<Self, TrackError> {
        let found = places.len();
        if found < LEAST_DOTS {
            return Err(TrackError::TooFewDots { found, least: LEAST_DOTS });
        }
        if found > MOST_DOTS {
            return Err(TrackError::TooManyDots { found, most: MOST_DOTS });
        }
        for (first, a) in places.iter().enumerate() {
            for (second, b) in places.iter().enumerate().skip(first + 1) {
                let apart_px = (a - b).norm();
                if apart_px.is_nan() || apart_px < 2.0 {
                    return Err(TrackError::Coincident { first, second, apart_px });
                }
            }
        }
        let mesh = Triangulation::of(&places);
        let length = |a: usize, b: usize| (places[a] - places[b]).norm();
        let spacing: Vec<f64> = (0..found)
            .map(|i| {
                let mut edges: Vec<f64> = (0..found).filter(|&j| j != i).map(|j| length(i, j)).collect();
                edges.select_nth_unstable_by(1, f64::total_cmp);
                edges[1]
            })
            .collect();
        let sound = |a: usize, b: usize| length(a, b) <= LONGEST_EDGE * spacing[a].min(spacing[b]);
        let linked: Vec<Vec<usize>> = (0..found)
            .map(|i| mesh.neighbours[i].iter().copied().filter(|&j| sound(i, j)).collect())
            .collect();
        let support = (0..found)
            .map(|i| {
                let mut near: Vec<usize> = linked[i].clone();
                near.extend(linked[i].iter().flat_map(|&j| &linked[j]));
                near.sort_unstable();
                near.dedup();
                near.retain(|&j| j != i);
                near.sort_by(|&a, &b| length(i, a).total_cmp(&length(i, b)));
                near.truncate(SUPPORT);
                near
            })
            .collect();
        let triangles = mesh
            .triangles
            .into_iter()
            .filter(|&[a, b, c]| sound(a, b) && sound(b, c) && sound(c, a))
            .collect();
        Ok(Self { places, spacing, support, triangles })
    }

    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Median spacing (px).
    pub(super) fn typical_spacing(&self) -> f64 {
        let mut spacing = self.spacing.clone();
        let middle = spacing.len() / 2;
        *spacing.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

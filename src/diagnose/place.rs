//! Where and when a baseline misses: channels, pokes and phases that stand out, and a place if there is one.

use super::confidence::PLAIN_SD;
use super::diagnosis::{Channel, Phase, Region};
use super::left::{Left, Mean};
use super::model::Model;
use crate::geometry::Vec3;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// A part of the readings stands out when it holds this share of all that is left beyond noise, plainly.
const SHARE: f64 = 0.1;

/// Shuffles of the permutation test, and its level.
const SHUFFLES: usize = 199;
const LEVEL: f64 = 0.01;

/// Markers this close (m) look at the same place.
const NEIGHBOURHOOD_M: f64 = 0.015;

/// A region wider than this share of the markers' extent is nowhere in particular.
const WIDEST: f64 = 0.3;

/// Parts of some readings that hold more than their share, the strongest first, with how many standard deviations of noise they hold.
fn standing_out<'m, T: PartialEq>(
    means: impl Iterator<Item = &'m Mean>,
    part: impl Fn(&Mean) -> T,
) -> Vec<(T, f64)> {
    let mut parts: Vec<(T, f64, f64)> = Vec::new();
    for mean in means {
        let beyond = mean.square - 1.0;
        let own = part(mean);
        match parts.iter_mut().find(|(p, ..)| *p == own) {
            Some((_, sum, n)) => {
                *sum += beyond;
                *n += 1.0;
            }
            None => parts.push((own, beyond, 1.0)),
        }
    }
    let all: f64 = parts.iter().map(|p| p.1.max(0.0)).sum();
    // Squares of means scatter by √2 each.
    parts.retain(|(_, sum, n)| *sum > SHARE * all && *sum > PLAIN_SD * (2.0 * n).sqrt());
    let mut plain: Vec<(T, f64)> = parts.into_iter().map(|(p, sum, n)| (p, sum / (2.0 * n).sqrt())).collect();
    plain.sort_by(|a, b| b.1.total_cmp(&a.1));
    plain
}

/// Parts that stand out in the force or in the markers, the strongest first.
///
/// Why apart: a hundred markers have fifty times as many means as the force. Summed up with them, what is plain in the force would drown.
fn standing_out_in_either<T: PartialEq>(left: &Left, part: impl Fn(&Mean) -> T) -> Vec<T> {
    let of = |marker: bool| left.means.iter().filter(move |m| m.marker.is_some() == marker);
    let mut either = standing_out(of(false), &part);
    either.extend(standing_out(of(true), &part));
    either.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut parts: Vec<T> = Vec::new();
    for (part, _) in either {
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    parts
}

/// The three views of a misfit.
pub(super) fn parts(model: &Model<'_>, left: &Left) -> (Vec<Channel>, Vec<u32>, Vec<Phase>) {
    let number = |mean: &Mean| model.tracks[mean.poke].number;
    let channels = standing_out(left.means.iter(), |m| m.channel).into_iter().map(|(channel, _)| channel);
    (channels.collect(), standing_out_in_either(left, number), standing_out_in_either(left, |m| m.phase))
}

/// Where the markers' misfit gathers: `None` where a shuffled map gathers as much, or where it is everywhere.
pub(super) fn region(model: &Model<'_>, left: &Left) -> Option<Region> {
    let rest = &model.settled.evidence.rest;
    let mut beyond = vec![0.0; rest.len()];
    let mut seen = vec![false; rest.len()];
    for mean in &left.means {
        if let Some(marker) = mean.marker {
            beyond[marker] += mean.square - 1.0;
            seen[marker] = true;
        }
    }
    let markers: Vec<usize> = (0..rest.len()).filter(|&m| seen[m]).collect();
    let place: Vec<Vec3> = markers.iter().map(|&m| rest[m].0).collect();
    let weight: Vec<f64> = markers.iter().map(|&m| beyond[m].max(0.0)).collect();
    let total: f64 = weight.iter().sum();
    if markers.len() < 6 || total <= 0.0 {
        return None;
    }
    let near: Vec<Vec<usize>> = place
        .iter()
        .map(|p| (0..place.len()).filter(|&j| (place[j] - p).norm() < NEIGHBOURHOOD_M).collect())
        .collect();
    let gathered = |weight: &[f64]| -> f64 {
        near.iter().zip(weight).map(|(near, w)| w * near.iter().map(|&j| weight[j]).sum::<f64>()).sum()
    };
    let own = gathered(&weight);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut shuffled = weight.clone();
    let mut as_much = 0;
    for _ in 0..SHUFFLES {
        shuffled.shuffle(&mut random);
        as_much += usize::from(gathered(&shuffled) >= own);
    }
    if (as_much + 1) as f64 / (SHUFFLES + 1) as f64 > LEVEL {
        return None;
    }
    // The heaviest neighbourhood, then the markers about its centroid that hold half of the misfit.
    let heaviest = (0..place.len()).max_by(|&a, &b| {
        let sum = |i: usize| near[i].iter().map(|&j| weight[j]).sum::<f64>();
        sum(a).total_cmp(&sum(b))
    })?;
    let within: f64 = near[heaviest].iter().map(|&j| weight[j]).sum();
    let centroid_m: Vec3 = near[heaviest].iter().map(|&j| place[j] * weight[j]).sum::<Vec3>() / within;
    let mut by_distance: Vec<(f64, f64)> =
        place.iter().zip(&weight).map(|(p, w)| ((p - centroid_m).norm(), *w)).collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sum = 0.0;
    let radius_m = by_distance
        .iter()
        .find(|(_, w)| {
            sum += w;
            sum >= 0.5 * total
        })?
        .0;
    let extent = |axis: usize| {
        let along = place.iter().map(|p| p[axis]);
        along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min)
    };
    let widest = (0..3).map(extent).fold(0.0, f64::max);
    (radius_m < WIDEST * widest).then_some(Region { centroid_m, radius_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What only the force of one poke shows is not lost among markers whose errors are taken for larger than they are, and what the markers of
    /// another show is not lost for it.
    #[test]
    fn a_poke_may_stand_out_in_the_force_alone() {
        let mean = |poke, channel, marker, square| Mean { poke, phase: Phase::Hold, channel, marker, square };
        let of_force =
            |poke: usize, square: f64| std::iter::repeat_n(mean(poke, Channel::ForceAlong, None, square), 8);
        let of_markers = |poke: usize, square: f64| {
            (0..400).map(move |m| mean(poke, Channel::Markers(2), Some(m), square))
        };
        let means = of_force(1, 1.0).chain(of_force(2, 30.0)).chain(of_force(3, 1.0));
        let means = means.chain(of_markers(1, 0.4)).chain(of_markers(2, 0.4)).chain(of_markers(3, 3.0));
        let left = Left { means: means.collect(), wanders: false };
        let mut pokes = standing_out_in_either(&left, |m| m.poke);
        pokes.sort_unstable();
        assert_eq!(pokes, [2, 3]);
        assert_eq!(standing_out(left.means.iter(), |m| m.poke)[0].0, 3);
        assert_eq!(standing_out_in_either(&left, |m| m.phase), [Phase::Hold]);
    }
}

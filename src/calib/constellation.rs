//! Which of the points that were seen are the known ones: by the distances between them alone, from wherever the camera looks.
//!
//! Three known points fix a motion. Every three seen points with the same distances are tried, and the motion is taken that puts most known
//! points on seen ones. Among the dots of a phantom three alone mean nothing: at least four have to agree, two thirds of all.

use super::CalibError;
use crate::geometry::{Mat3, Vec3};

/// Known points that have to be found, at least.
const NEEDED: usize = 4;

/// For each known point the seen one that it is, or none where it was not seen. `tolerance_m`: how far apart the two may be after
/// the motion that fits best (m).
///
/// # Errors
/// [`CalibError`]: fewer than four known points, too few of them among the seen ones, two ways to find as many.
pub fn match_constellation(
    seen_m: &[Vec3],
    known_m: &[Vec3],
    tolerance_m: f64,
) -> Result<Vec<Option<usize>>, CalibError> {
    let known = known_m.len();
    if known < NEEDED {
        return Err(CalibError::TooFew { what: "known points", found: known, needed: NEEDED });
    }
    let needed = NEEDED.max((2 * known).div_ceil(3));
    let mut best: Vec<Option<usize>> = vec![None; known];
    let (mut most, mut second) = (0, 0);
    for base in bases(known_m) {
        let sides = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| (known_m[base[a]] - known_m[base[b]]).norm());
        let alike = |a: usize, b: usize, side: f64| {
            // Each end may be off by the tolerance.
            ((seen_m[a] - seen_m[b]).norm() - side).abs() <= 2.0 * tolerance_m
        };
        for first in 0..seen_m.len() {
            for next in (0..seen_m.len()).filter(|&n| n != first && alike(first, n, sides[0])) {
                let third = (0..seen_m.len()).filter(|&t| {
                    t != first && t != next && alike(next, t, sides[1]) && alike(t, first, sides[2])
                });
                for third in third {
                    let Some(motion) =
                        carry(base.map(|k| known_m[k]), [first, next, third].map(|s| seen_m[s]))
                    else {
                        continue;
                    };
                    let found = matches(seen_m, known_m, &motion, tolerance_m);
                    let count = found.iter().flatten().count();
                    if found == best {
                        continue;
                    }
                    if count > most {
                        (second, most, best) = (most, count, found);
                    } else {
                        second = second.max(count);
                    }
                }
            }
        }
        if most == known {
            // Nothing can be matched better; another way to match as many would have shown from this base too.
            break;
        }
    }
    if most < needed {
        return Err(CalibError::NoMatch { found: most, known, seen: seen_m.len(), needed });
    }
    if second == most {
        return Err(CalibError::Ambiguous { best: most, second });
    }
    Ok(best)
}

/// All triples of known points, the largest triangle first.
fn bases(known_m: &[Vec3]) -> Vec<[usize; 3]> {
    let count = known_m.len();
    let mut triples: Vec<(f64, [usize; 3])> = Vec::new();
    for a in 0..count {
        for b in a + 1..count {
            for c in b + 1..count {
                let area = 0.5 * (known_m[b] - known_m[a]).cross(&(known_m[c] - known_m[a])).norm();
                triples.push((area, [a, b, c]));
            }
        }
    }
    triples.sort_by(|x, y| y.0.total_cmp(&x.0));
    triples.into_iter().filter(|(area, _)| *area > 0.0).map(|(_, base)| base).collect()
}

/// The motion that carries one triangle to the other, corner to corner as well as it goes: turn and shift.
fn carry(from: [Vec3; 3], to: [Vec3; 3]) -> Option<(Mat3, Vec3)> {
    let frame = |corners: [Vec3; 3]| {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let along = (corners[1] - corners[0]).try_normalize(0.0)?;
        let normal = along.cross(&(corners[2] - corners[0])).try_normalize(0.0)?;
        Some((Mat3::from_columns(&[along, normal.cross(&along), normal]), centre))
    };
    let ((a, from), (b, to)) = (frame(from)?, frame(to)?);
    let turn = b * a.transpose();
    Some((turn, to - turn * from))
}

/// For each known point the nearest seen one within the tolerance; a seen one is taken once.
fn matches(
    seen_m: &[Vec3],
    known_m: &[Vec3],
    (turn, shift): &(Mat3, Vec3),
    tolerance_m: f64,
) -> Vec<Option<usize>> {
    let mut taken = vec![false; seen_m.len()];
    known_m
        .iter()
        .map(|known| {
            let at = turn * known + shift;
            let near = (0..seen_m.len())
                .filter(|&s| !taken[s])
                .map(|s| (s, (seen_m[s] - at).norm()))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, distance)| *distance <= tolerance_m);
            near.map(|(s, _)| {
                taken[s] = true;
                s
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// Fiducials round a phantom, without symmetry.
    fn fiducials() -> Vec<Vec3> {
        [
            [-10.0, -8.0, 25.0],
            [158.0, -9.0, 25.0],
            [161.0, 92.0, 25.0],
            [70.0, 112.0, 25.0],
            [-12.0, 60.0, 25.0],
        ]
        .map(|p| Vec3::from(p) * 1e-3)
        .to_vec()
    }

    /// The fiducials among the dots of a phantom (a grid of 12 mm), as a turned camera sees them; the dots come first.
    fn scene(fiducials: &[Vec3], hidden: &[usize]) -> Vec<Vec3> {
        let turn = Rotation3::from_euler_angles(3.0, 0.15, 1.0);
        let shift = Vec3::new(0.03, -0.02, 0.4);
        let dots = (0..96)
            .map(|i| Vec3::new(0.01 + 0.012 * (i % 12) as f64, 0.008 + 0.012 * (i / 12) as f64, 0.025));
        let kept = fiducials.iter().enumerate().filter(|(i, _)| !hidden.contains(i)).map(|(_, p)| *p);
        dots.chain(kept).map(|p| turn * p + shift).collect()
    }

    #[test]
    fn fiducials_are_found_among_the_dots_of_a_phantom() {
        let known = fiducials();
        let found = match_constellation(&scene(&known, &[]), &known, 1e-3).expect("all are there");
        assert_eq!(found, (96..101).map(Some).collect::<Vec<_>>());
        // One of them lies in the largest triangle.
        let found = match_constellation(&scene(&known, &[1]), &known, 1e-3).expect("four are there");
        assert_eq!(found, [Some(96), None, Some(97), Some(98), Some(99)]);
    }

    #[test]
    fn too_few_or_ambiguous_ones_are_not_matched() {
        let known = fiducials();
        let few = match_constellation(&scene(&known, &[0, 1]), &known, 1e-3);
        assert!(matches!(few, Err(CalibError::NoMatch { needed: 4, known: 5, .. })), "{few:?}");
        assert!(matches!(match_constellation(&[], &known[..3], 1e-3), Err(CalibError::TooFew { .. })));
        // A rectangle looks the same from its other side.
        let rectangle: Vec<Vec3> =
            [[0.0, 0.0], [0.2, 0.0], [0.2, 0.13], [0.0, 0.13]].map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let seen = scene(&rectangle, &[]);
        assert!(matches!(match_constellation(&seen, &rectangle, 1e-3), Err(CalibError::Ambiguous { .. })));
    }
}

//! When pictures were taken that carry the times of their arrival only.

use crate::clock::Beat;
use crate::device::MarkerPosition;

/// Puts frames on the beat of their camera, as late as they usually come, in place of the times of their arrival. Two that arrive within
/// one interval waited for each other somewhere; which is whose nobody knows, and both are left out. What there is to say of it, for people.
pub(super) fn put_on_beat(frames: &mut Vec<(f64, Vec<MarkerPosition>)>) -> Option<String> {
    let arrivals_s: Vec<f64> = frames.iter().map(|f| f.0).collect();
    let Some(beat) = Beat::of(&arrivals_s) else {
        return (!frames.is_empty())
            .then(|| "pictures do not come at equal intervals: each counts from its own arrival".to_owned());
    };
    let placed: Vec<(i64, f64)> = arrivals_s.iter().map(|t| beat.before(*t)).collect();
    let alone = |i: usize| {
        let number = |j: usize| placed.get(j).map(|p| p.0);
        (i == 0 || number(i - 1) != number(i)) && number(i + 1) != number(i)
    };
    let before = frames.len();
    let mut index = 0..;
    frames.retain_mut(|frame| {
        index.next().is_some_and(|i: usize| {
            frame.0 = placed[i].1;
            alone(i)
        })
    });
    let left_out = before - frames.len();
    (left_out > 0).then(|| {
        format!("{left_out} pictures arrived in one interval with another and are left out: when they were taken is not known")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn frames(arrivals_s: impl IntoIterator<Item = f64>) -> Vec<(f64, Vec<MarkerPosition>)> {
        let marker = |at| MarkerPosition { marker: 1, position_m: [at, 0.0, 0.0] };
        arrivals_s.into_iter().map(|t| (t, vec![marker(t)])).collect()
    }

    /// 10 Hz; every third picture is 12 ms late, the twentieth waits until the next is there.
    #[test]
    fn pictures_that_waited_for_each_other_are_left_out() {
        let late_s = |n: u32| if n == 20 { 0.095 } else { 0.012 * f64::from(u8::from(n.is_multiple_of(3))) };
        let arrived = |n: u32| 0.1 * f64::from(n) + late_s(n);
        let mut seen = frames((0..60).map(arrived));
        let said = put_on_beat(&mut seen).expect("a remark");
        assert!(said.starts_with("2 pictures"), "{said}");
        assert_eq!(seen.len(), 58);
        let expected = (0..60).filter(|n| ![20, 21].contains(n));
        for ((t, markers), n) in seen.iter().zip(expected) {
            assert!((t - 0.1 * f64::from(n) - 0.004).abs() < 2e-3, "{n}: {t}");
            assert_eq!(markers[0].position_m[0], arrived(n));
        }
    }

    #[test]
    fn a_camera_without_a_beat_keeps_its_arrivals() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let uneven: Vec<f64> = (0..60).map(|n| 0.1 * f64::from(n) + random.random_range(0.0..0.09)).collect();
        let (mut seen, as_before) = (frames(uneven.clone()), frames(uneven));
        assert!(put_on_beat(&mut seen).is_some_and(|said| said.contains("equal intervals")));
        assert_eq!(seen, as_before);
        assert_eq!(put_on_beat(&mut Vec::new()), None);
    }
}

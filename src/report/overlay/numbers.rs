//! Where the number of each dot stands: beside its ring, over no ring and no other number.

/// A number to be placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beside {
    /// Centre of its dot's ring (px).
    pub(super) centre: [f64; 2],
    /// Radius of the ring (px).
    pub(super) radius: f64,
    /// Width and height of what is written (px); none where nothing is.
    pub(super) size: Option<[u32; 2]>,
}

/// Which way a number may stand from its dot, the best first, in radii of the ring.
const WAYS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [0.0, 1.0],
    [0.0, -1.0],
    [-1.0, 0.0],
    [0.75, 0.75],
    [0.75, -0.75],
    [-0.75, 0.75],
    [-0.75, -0.75],
];

/// A rectangle: its lower and its upper ends.
type Bounds = [[f64; 2]; 2];

/// The upper left corner of each number in a picture of `size` (px) when it keeps `gap` px from rings and other numbers; none where there is
/// no room.
pub(super) fn placed(dots: &[Beside], size: [u32; 2], gap: f64) -> Vec<Option<[i64; 2]>> {
    let mut taken: Vec<Bounds> = Vec::new();
    let free = |bounds: &Bounds, taken: &[Bounds]| {
        let inside = (0..2).all(|a| bounds[0][a] >= 0.0 && bounds[1][a] <= f64::from(size[a]));
        inside
            && !taken.iter().any(|other| overlap(bounds, other, gap))
            && !dots.iter().any(|dot| distance(bounds, dot.centre) < dot.radius + 0.5 * gap)
    };
    dots.iter()
        .map(|dot| {
            let written = dot.size?.map(f64::from);
            let found = WAYS.iter().map(|way| stands(dot, written, *way, gap)).find(|b| free(b, &taken))?;
            taken.push(found);
            Some(found[0].map(|c| c as i64))
        })
        .collect()
}

/// A number of this size, `way` from its dot.
fn stands(dot: &Beside, size: [f64; 2], way: [f64; 2], gap: f64) -> Bounds {
    let low = [0, 1].map(|a| {
        let side = if way[a] == 0.0 { 0.0 } else { way[a].signum() };
        let middle = dot.centre[a] + way[a] * (dot.radius + gap) + side * 0.5 * size[a];
        (middle - 0.5 * size[a]).round()
    });
    [low, [0, 1].map(|a| low[a] + size[a])]
}

fn overlap(one: &Bounds, other: &Bounds, gap: f64) -> bool {
    (0..2).all(|a| one[0][a] < other[1][a] + gap && other[0][a] < one[1][a] + gap)
}

/// From a point to a rectangle; 0 inside.
fn distance(bounds: &Bounds, point: [f64; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|a| (bounds[0][a] - point[a]).max(point[a] - bounds[1][a]).max(0.0));
    dx.hypot(dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crowded grid whose dots lie as close as numbers just fit between, and one dot in the corner.
    #[test]
    fn numbers_cover_no_dot_no_other_number_and_are_all_there() {
        let size = [17, 8];
        let at = |x: f64, y: f64| Beside { centre: [x, y], radius: 6.0, size: Some(size) };
        let mut dots: Vec<Beside> =
            (0..100).map(|i| at(30.0 + 26.0 * f64::from(i % 10), 30.0 + 25.0 * f64::from(i / 10))).collect();
        dots.push(at(2.0, 2.0));
        let found = placed(&dots, [300, 300], 2.0);
        let bounds: Vec<Bounds> = found
            .iter()
            .map(|corner| {
                let low = corner.expect("room").map(|c| c as f64);
                [low, [low[0] + 17.0, low[1] + 8.0]]
            })
            .collect();
        for (i, one) in bounds.iter().enumerate() {
            assert!(one[0].iter().all(|c| *c >= 0.0) && one[1].iter().all(|c| *c <= 300.0), "{one:?}");
            assert!(dots.iter().all(|dot| distance(one, dot.centre) >= dot.radius), "{i} covers a ring");
            assert!(!bounds[..i].iter().any(|other| overlap(one, other, 0.0)), "{i} covers a number");
            assert!(distance(one, dots[i].centre) < 10.0, "{i} stands away from its dot");
        }
    }

    #[test]
    fn where_there_is_no_room_there_is_no_number() {
        let dot = |size| Beside { centre: [10.0, 10.0], radius: 6.0, size };
        assert_eq!(placed(&[dot(Some([17, 8])), dot(None)], [20, 20], 2.0), [None, None]);
        assert!(placed(&[dot(Some([17, 8]))], [60, 20], 2.0)[0].is_some());
    }
}

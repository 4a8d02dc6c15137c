//! Which detections are near a place: a grid of cells.

use nalgebra::Vector2;

/// Points sorted into square cells.
pub(super) struct Near<'a> {
    points: &'a [Vector2<f64>],
    low: Vector2<f64>,
    cell: f64,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<usize>>,
}

impl<'a> Near<'a> {
    pub(super) fn new(points: &'a [Vector2<f64>], cell: f64) -> Self {
        let low = points.iter().fold(Vector2::repeat(f64::MAX), |a, p| a.inf(p));
        let high = points.iter().fold(Vector2::repeat(f64::MIN), |a, p| a.sup(p));
        let count = |extent: f64| ((extent / cell) as usize + 1).min(1000);
        let (columns, rows) =
            if points.is_empty() { (0, 0) } else { (count(high.x - low.x), count(high.y - low.y)) };
        let mut cells = vec![Vec::new(); columns * rows];
        for (i, p) in points.iter().enumerate() {
            let [x, y] = [0, 1].map(|k| ((p[k] - low[k]) / cell) as usize);
            cells[y.min(rows - 1) * columns + x.min(columns - 1)].push(i);
        }
        Self { points, low, cell, columns, rows, cells }
    }

    /// Points within `radius` of a place, with their distances.
    pub(super) fn within(&self, place: Vector2<f64>, radius: f64) -> impl Iterator<Item = (usize, f64)> {
        let range = |k: usize, count: usize| {
            let at = |v: f64| (((v - self.low[k]) / self.cell).max(0.0) as usize).min(count.max(1) - 1);
            at(place[k] - radius)..(at(place[k] + radius) + 1).min(count)
        };
        let (across, down) = (range(0, self.columns), range(1, self.rows));
        down.flat_map(move |y| across.clone().map(move |x| y * self.columns + x))
            .flat_map(|c| self.cells[c].iter())
            .map(move |&i| (i, (self.points[i] - place).norm()))
            .filter(move |&(_, d)| d <= radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    #[test]
    fn nobody_near_is_missed() {
        let mut random = Noise::seeded(2);
        let mut draw = || Vector2::new(random.uniform(), random.uniform()) * 500.0;
        let points: Vec<_> = (0..300).map(|_| draw()).collect();
        let near = Near::new(&points, 40.0);
        for _ in 0..200 {
            let place = draw() * 1.4 - Vector2::repeat(100.0);
            let mut found: Vec<usize> = near.within(place, 55.0).map(|(i, _)| i).collect();
            found.sort_unstable();
            let expected: Vec<usize> = (0..300).filter(|&i| (points[i] - place).norm() <= 55.0).collect();
            assert_eq!(found, expected);
        }
        assert_eq!(Near::new(&[], 10.0).within(Vector2::zeros(), 5.0).count(), 0);
    }
}

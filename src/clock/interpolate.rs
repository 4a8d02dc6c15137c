//! What a recorded channel reads between two of its rows.
//!
//! A row holds until it is interpolated: linearly between neighbouring rows, but never across a gap longer
//! than five times the channel's median spacing, and never across the limits of a poke.

/// Times of a channel's rows (s, ascending) with the longest gap that may be bridged.
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    time_s: &'a [f64],
    longest_gap_s: f64,
}

impl<'a> Rows<'a> {
    /// `time_s` in ascending order, as a checked recording guarantees.
    pub fn new(time_s: &'a [f64]) -> Self {
        let mut spacing: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
        spacing.sort_by(f64::total_cmp);
        let median = spacing.get(spacing.len() / 2).copied().unwrap_or(0.0);
        Self { time_s, longest_gap_s: 5.0 * median }
    }

    /// The rows inside `[start_s, end_s]`.
    pub fn within(&self, start_s: f64, end_s: f64) -> std::ops::Range<usize> {
        let first = self.time_s.partition_point(|&t| t < start_s);
        let last = self.time_s.partition_point(|&t| t <= end_s);
        first..last.max(first)
    }

    /// The value at `at_s` of a channel whose row `i` holds `value[i]`, using only rows inside
    /// `[start_s, end_s]`; `None` where the rules above forbid an answer.
    pub fn at(&self, value: &[[f64; 3]], at_s: f64, start_s: f64, end_s: f64) -> Option<[f64; 3]> {
        let rows = self.within(start_s, end_s);
        let after = self.time_s[rows.clone()].partition_point(|&t| t < at_s) + rows.start;
        if after < rows.end && self.time_s[after] == at_s {
            return Some(value[after]);
        }
        if after == rows.start || after >= rows.end {
            return None;
        }
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        if t1 - t0 > self.longest_gap_s {
            return None;
        }
        let share = (at_s - t0) / (t1 - t0);
        let (a, b) = (value[after - 1], value[after]);
        Some(std::array::from_fn(|i| a[i] + share * (b[i] - a[i])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, 20.0];
    fn values() -> Vec<[f64; 3]> {
        T.iter().map(|&t| [2.0 * t, -t, 1.0]).collect()
    }

    #[test]
    fn linear_between_rows() {
        assert_eq!(Rows::new(&T).at(&values(), 1.25, 0.0, 30.0), Some([2.5, -1.25, 1.0]));
        assert_eq!(Rows::new(&T).at(&values(), 3.0, 0.0, 30.0), Some([6.0, -3.0, 1.0]));
    }

    #[test]
    fn no_value_across_a_long_gap() {
        assert_eq!(Rows::new(&T).at(&values(), 10.0, 0.0, 30.0), None);
    }

    #[test]
    fn no_value_across_the_limits_of_a_poke() {
        assert_eq!(Rows::new(&T).at(&values(), 2.5, 0.0, 2.6), None);
        assert_eq!(Rows::new(&T).at(&values(), 0.5, 0.6, 4.0), None);
    }
}

//! Raw records of the force sensor → rows: means over equal spans of time between limits that none reaches across.

use std::ops::Range;

/// Spans of about the wanted length, cut from stretches one after the other.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spans {
    /// Limits of the spans (s), ascending.
    limits: Vec<f64>,
}

impl Spans {
    /// Cuts the stretch between each two of `limits` (s, ascending) into equal spans of about `span_s`.
    pub(super) fn new(limits: &[f64], span_s: f64) -> Self {
        let mut all = Vec::new();
        for stretch in limits.windows(2) {
            let count = ((stretch[1] - stretch[0]) / span_s).round().max(1.0);
            all.extend(
                (0..count as usize).map(|i| stretch[0] + (stretch[1] - stretch[0]) * i as f64 / count),
            );
        }
        all.extend(limits.last());
        Self { limits: all }
    }
}

/// Sums of what falls into each span.
#[derive(Debug, Clone)]
pub(super) struct Means {
    spans: Spans,
    sums: Vec<[f64; 6]>,
    counts: Vec<u32>,
}

impl Means {
    pub(super) fn new(spans: Spans) -> Self {
        let n = spans.limits.len().saturating_sub(1);
        Self { spans, sums: vec![[0.0; 6]; n], counts: vec![0; n] }
    }

    /// Takes a value at a time; outside of all spans it counts for nothing.
    pub(super) fn take(&mut self, time_s: f64, value: [f64; 6]) {
        let after = self.spans.limits.partition_point(|&l| l <= time_s);
        let Some(span) = after.checked_sub(1).filter(|&s| s < self.sums.len()) else { return };
        for (sum, v) in self.sums[span].iter_mut().zip(value) {
            *sum += v;
        }
        self.counts[span] += 1;
    }

    /// Middle (s) and mean of each span that holds at least half of the records that a span of its length should, at `rate_hz`.
    pub(super) fn rows(&self, rate_hz: f64) -> Vec<(f64, [f64; 6])> {
        let whole: Range<usize> = 0..self.sums.len();
        whole
            .filter_map(|s| {
                let (from, to) = (self.spans.limits[s], self.spans.limits[s + 1]);
                let n = f64::from(self.counts[s]);
                let enough = n > 0.0 && n >= 0.5 * rate_hz * (to - from);
                enough.then(|| (0.5 * (from + to), self.sums[s].map(|x| x / n)))
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_span_reaches_across_a_limit_and_a_gap_leaves_no_row() {
        let spans = Spans::new(&[0.0, 0.5, 0.55, 1.0], 0.02);
        let step = spans.limits.windows(2).map(|w| w[1] - w[0]);
        assert!(step.clone().all(|s| s > 0.014 && s < 0.026), "{:?}", step.collect::<Vec<_>>());
        assert!(spans.limits.contains(&0.5) && spans.limits.contains(&0.55));
        let mut means = Means::new(spans);
        // 1 kHz; nothing between 0.2 s and 0.3 s.
        for n in (0..1000).filter(|n| !(200..300).contains(n)) {
            let t = f64::from(n) * 1e-3 + 2e-4;
            let value = if (0.5..0.55).contains(&t) { 1.0 } else { 0.0 };
            means.take(t, [value, t, 0.0, 0.0, 0.0, 0.0]);
        }
        let rows = means.rows(1000.0);
        for (t, v) in &rows {
            assert!(v[0] == if (0.5..0.55).contains(t) { 1.0 } else { 0.0 }, "{t}: {v:?}");
            assert!((v[1] - t).abs() < 1e-3, "{t}: {v:?}");
        }
        assert!(rows.iter().all(|r| !(0.2..0.3).contains(&r.0)) && rows.len() > 40);
    }
}

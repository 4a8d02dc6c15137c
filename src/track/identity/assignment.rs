//! Who gets what at the least total cost, when anybody may also go without: shortest augmenting paths (Jonker & Volgenant 1987).
//!
//! Made for the small clusters that gates leave over.

/// For each row the column that it gets. `cost` gives what a pair costs, or none when it is out of the question; going without costs
/// `without`. A row never gets a column that costs more than going without.
pub(super) fn assign(
    rows: usize,
    columns: usize,
    without: f64,
    cost: impl Fn(usize, usize) -> Option<f64>,
) -> Vec<Option<usize>> {
    // Each row has a column of its own to go without; columns are counted from 1, and column 0 is the root of the search.
    let all = columns + rows;
    let price = |row: usize, column: usize| -> f64 {
        if column < columns {
            cost(row, column).unwrap_or(f64::INFINITY)
        } else if column - columns == row {
            without
        } else {
            f64::INFINITY
        }
    };
    let mut row_price = vec![0.0; rows + 1];
    let mut column_price = vec![0.0; all + 1];
    let mut owner = vec![0_usize; all + 1];
    for row in 1..=rows {
        owner[0] = row;
        let mut reached = 0;
        let mut distance = vec![f64::INFINITY; all + 1];
        let mut from = vec![0_usize; all + 1];
        let mut done = vec![false; all + 1];
        loop {
            done[reached] = true;
            let here = owner[reached];
            let (mut least, mut next) = (f64::INFINITY, 0);
            for column in 1..=all {
                if done[column] {
                    continue;
                }
                let reduced = price(here - 1, column - 1) - row_price[here] - column_price[column];
                if reduced < distance[column] {
                    distance[column] = reduced;
                    from[column] = reached;
                }
                if distance[column] < least {
                    (least, next) = (distance[column], column);
                }
            }
            // Its own column to go without is always within reach.
            for column in 0..=all {
                if done[column] {
                    row_price[owner[column]] += least;
                    column_price[column] -= least;
                } else {
                    distance[column] -= least;
                }
            }
            reached = next;
            if owner[reached] == 0 {
                break;
            }
        }
        while reached != 0 {
            owner[reached] = owner[from[reached]];
            reached = from[reached];
        }
    }
    let mut result = vec![None; rows];
    for column in 1..=columns {
        if owner[column] > 0 {
            result[owner[column] - 1] = Some(column - 1);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::tests::random::Noise;

    fn total(choice: &[Option<usize>], costs: &[Vec<Option<f64>>], without: f64) -> f64 {
        choice.iter().enumerate().map(|(r, c)| c.map_or(without, |c| costs[r][c].expect("allowed"))).sum()
    }

    /// Least total over every choice there is.
    fn least(row: usize, taken: u32, costs: &[Vec<Option<f64>>], without: f64) -> f64 {
        if row == costs.len() {
            return 0.0;
        }
        let mut best = without + least(row + 1, taken, costs, without);
        for (column, cost) in costs[row].iter().enumerate() {
            if let Some(cost) = cost.filter(|_| taken & (1 << column) == 0) {
                best = best.min(cost + least(row + 1, taken | (1 << column), costs, without));
            }
        }
        best
    }

    #[test]
    fn no_other_choice_costs_less() {
        let mut random = Noise::seeded(11);
        for trial in 0..300 {
            let (rows, columns) = (1 + trial % 6, 1 + (trial / 6) % 6);
            let costs: Vec<Vec<Option<f64>>> = (0..rows)
                .map(|_| (0..columns).map(|_| (random.uniform() < 0.7).then(|| random.uniform())).collect())
                .collect();
            let choice = assign(rows, columns, 0.6, |r, c| costs[r][c]);
            let mut used: Vec<usize> = choice.iter().flatten().copied().collect();
            used.sort_unstable();
            assert!(used.windows(2).all(|w| w[0] != w[1]));
            assert!((total(&choice, &costs, 0.6) - least(0, 0, &costs, 0.6)).abs() < 1e-12);
        }
    }
}

//! Which places make a grid, and in which order are they visited?
//!
//! `place = origin + first · along₁ + second · along₂`. Places are numbered row by row (first changes fastest), whatever the order.

use super::quantity::Allowed;
use super::refusal::{Refusal, nearest};
use super::section::Section;
use super::steps::Place;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

pub(super) const KEYS: [&str; 8] =
    ["origin_mm", "along", "spacing_mm", "counts", "first_mm", "second_mm", "order", "seed"];

/// How places follow one another.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Order {
    /// Row by row, each from its start.
    Rows,
    /// Column by column, each from its start.
    Columns,
    /// Row by row, every other one backwards.
    Serpentine,
    /// Shuffled.
    Random(u64),
}

/// Steps along one direction.
#[derive(Debug, Clone, PartialEq)]
enum Steps {
    Even { spacing_m: f64, count: u32 },
    Listed(Vec<f64>),
}

impl Steps {
    fn count(&self) -> u64 {
        match self {
            Self::Even { count, .. } => u64::from(*count),
            Self::Listed(list) => list.len() as u64,
        }
    }

    fn all(&self) -> Vec<f64> {
        match self {
            Self::Even { spacing_m, count } => (0..*count).map(|i| f64::from(i) * spacing_m).collect(),
            Self::Listed(list) => list.clone(),
        }
    }
}

/// A grid before its places are made.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    origin_m: [f64; 3],
    along: [[f64; 3]; 2],
    steps: [Steps; 2],
    order: Order,
}

impl Grid {
    /// How many places there are.
    pub(super) fn places(&self) -> u64 {
        self.steps[0].count().saturating_mul(self.steps[1].count())
    }

    /// The places in the order of their visits. As many as [`Grid::places`] says: to be looked at before.
    pub(super) fn visited(&self) -> Vec<Place> {
        let [first, second] = [self.steps[0].all(), self.steps[1].all()];
        let place = |row: usize, column: usize| {
            let (a, b) = (first[column], second[row]);
            let site_m =
                std::array::from_fn(|i| self.origin_m[i] + a * self.along[0][i] + b * self.along[1][i]);
            Place { number: (row * first.len() + column) as u32 + 1, site_m }
        };
        let (rows, columns) = (0..second.len(), 0..first.len());
        let by_rows = || rows.clone().flat_map(|row| columns.clone().map(move |column| place(row, column)));
        match self.order {
            Order::Rows => by_rows().collect(),
            Order::Columns => {
                columns.clone().flat_map(|column| rows.clone().map(move |row| place(row, column))).collect()
            }
            Order::Serpentine => {
                let turned =
                    |row: usize, i: usize| if row.is_multiple_of(2) { i } else { first.len() - 1 - i };
                rows.flat_map(|row| columns.clone().map(move |i| place(row, turned(row, i)))).collect()
            }
            Order::Random(seed) => {
                let mut places: Vec<Place> = by_rows().collect();
                places.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
                places
            }
        }
    }
}

/// Reads the grid's own keys.
pub(super) fn read(step: &Section<'_, '_>) -> Result<Grid, Refusal> {
    let origin_m = step.place("origin_mm")?;
    let mut along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for (direction, said) in along.iter_mut().zip(step.unit_vectors("along")?.unwrap_or_default()) {
        *direction = said;
    }
    Ok(Grid { origin_m, along, steps: steps(step)?, order: order(step)? })
}

fn steps(step: &Section<'_, '_>) -> Result<[Steps; 2], Refusal> {
    for (key, other) in [("first_mm", "spacing_mm"), ("first_mm", "counts"), ("second_mm", "spacing_mm")] {
        if step.says(key) && step.says(other) {
            return Err(step.exclusive(key, other));
        }
    }
    if let Some(first) = step.numbers("first_mm", Allowed::PLACE_MM)? {
        let second = step.numbers("second_mm", Allowed::PLACE_MM)?.unwrap_or_else(|| vec![0.0]);
        return Ok([Steps::Listed(first), Steps::Listed(second)]);
    }
    let expected = "the distance between places, [first] or [first, second], or a list first_mm";
    let spacing = step.numbers("spacing_mm", Allowed::PLACE_MM)?;
    let spacing = spacing.ok_or_else(|| step.missing("spacing_mm", expected))?;
    let counts = step.numbers("counts", Allowed::COUNT)?;
    let counts =
        counts.ok_or_else(|| step.missing("counts", "how many places, [first] or [first, second]"))?;
    if let Some(value) = step.find("counts").filter(|_| counts.len() != spacing.len() || counts.len() > 2) {
        return Err(step.wrong("counts", value, "one or two counts, as many as spacing_mm has distances"));
    }
    let even = |i: usize| Steps::Even {
        spacing_m: spacing.get(i).copied().unwrap_or(0.0),
        // The range of a count fits.
        count: counts.get(i).map_or(1, |count| *count as u32),
    };
    let steps = [even(0), even(1)];
    let on_the_spot =
        |s: &Steps| matches!(s, Steps::Even { spacing_m, count } if *spacing_m == 0.0 && *count > 1);
    match step.find("spacing_mm") {
        Some(value) if steps.iter().any(on_the_spot) => {
            Err(step.wrong("spacing_mm", value, "a distance other than 0 where counts is more than 1"))
        }
        _ => Ok(steps),
    }
}

fn order(step: &Section<'_, '_>) -> Result<Order, Refusal> {
    const NAMES: [&str; 4] = ["rows", "columns", "serpentine", "random"];
    let said = step.text("order")?.unwrap_or(NAMES[0]);
    if let Some(value) = step.find("seed").filter(|_| said != "random") {
        return Err(step.wrong("seed", value, "order = \"random\" beside it"));
    }
    match said {
        "rows" => Ok(Order::Rows),
        "columns" => Ok(Order::Columns),
        "serpentine" => Ok(Order::Serpentine),
        "random" => Ok(Order::Random(step.need("seed", Allowed::SEED)? as u64)),
        _ => {
            let expected = format!("one of {}", NAMES.map(|n| format!("\"{n}\"")).join(", "));
            let meant = nearest(said, NAMES.into_iter()).map(|n| format!("; did you mean \"{n}\"?"));
            let value = step.find("order").ok_or_else(|| step.missing("order", expected.clone()))?;
            Err(step.wrong("order", value, expected + &meant.unwrap_or_default()))
        }
    }
}

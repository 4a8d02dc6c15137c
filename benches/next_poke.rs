//! Whether the pokes that diagnoses ask for tell sooner than pokes at random.
//!
//! Every draw is a world in which one entry of the catalogue acts. Its session begins with two pokes; then, twice over, one poke after
//! another is added until a reading stands alone with 95 % confidence: the poke that tells most for its time, and one at random among the
//! same. Each is a row of a table, which is added to as soon as the row is known: draws that are in it are not made again, so that a
//! run of hours may be stopped and goes on. The medians at the end are of those draws of the whole table whose first two pokes did not settle
//! it and that either way found the right name; what did not find it counts as more than any number of pokes. They are asserted nowhere: the
//! figures are for people.
//!
//! ```sh
//! cargo bench --bench next_poke -- --draws 50 --first-seed 1 --table target/next_poke.csv
//! ```

use phantom_rig::diagnose::{Choice, Diagnosis, Settings, diagnose};
use phantom_rig::sim::{Answer, Phantom, World};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;
use table::Table;

#[path = "support/table.rs"]
mod table;

/// One way of choosing pokes in one draw.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Row {
    seed: u64,
    concealed: String,
    at_random: bool,
    /// Pokes added.
    pokes: usize,
    /// Time of the bench that they took (s).
    bench_s: f64,
    /// Whether a reading stood alone then.
    alone: bool,
    named: String,
    confidence: f64,
}

/// Pokes that a session begins with, as few as can be diagnosed, and pokes that are added at most.
const FIRST: usize = 2;
const MOST: usize = 6;

/// Phantoms that the draws share.
const PHANTOMS: u64 = 4;

/// A draw in which one entry of the catalogue acts.
fn world(seed: u64) -> Option<(World, &'static str)> {
    let mut world = World::draw(seed, STOCK, PHANTOMS);
    world.pokes.truncate(FIRST);
    match Answer::of(&world).physics[..] {
        [physics] if physics != "unexplained" => Some((world, physics)),
        _ => None,
    }
}

const STOCK: u64 = 1;

fn stands_alone(said: &Diagnosis, enough: f64) -> bool {
    let verdict = &said.verdict;
    verdict.ambiguous_with.is_empty() && !verdict.unexplained && verdict.confidence >= enough
}

/// Adds pokes to a session until a reading stands alone.
fn rounds(mut world: World, concealed: &str, choice: Choice) -> Result<Row, Box<dyn Error>> {
    let seed = world.seed;
    let settings = Settings { choice, ..Settings::default() };
    let phantom = Phantom::prepare(&world.phantom)?;
    let mut bench_s = 0.0;
    loop {
        let recording = world.record(&phantom)?;
        let said = diagnose(&recording, &settings, &mut |_| {})?;
        let added = recording.pokes.len() - FIRST;
        if added > 0 {
            let last = recording.pokes.last().ok_or("no poke")?;
            bench_s += recording.pause_s() + last.end_s - last.start_s;
        }
        let alone = stands_alone(&said, settings.enough);
        match said.next_poke.filter(|_| !alone && added < MOST) {
            Some(next) => world.press(&next.poke)?,
            None => {
                let named: Vec<&str> = said.verdict.physics.iter().map(|p| p.id()).collect();
                return Ok(Row {
                    seed,
                    concealed: concealed.to_owned(),
                    at_random: matches!(choice, Choice::Random(_)),
                    pokes: added,
                    bench_s,
                    alone,
                    named: named.join(" "),
                    confidence: said.verdict.confidence,
                });
            }
        }
    }
}

impl Row {
    /// Pokes until the right name stood alone.
    fn needed(&self) -> f64 {
        if self.alone && self.named == self.concealed { self.pokes as f64 } else { f64::INFINITY }
    }
}

fn median(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    match of.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => of[n / 2],
        n => 0.5 * (of[n / 2 - 1] + of[n / 2]),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let argument = |name: &str| std::env::args().skip_while(|a| a != name).nth(1);
    let number = |name: &str, default: u64| argument(name).map_or(Ok(default), |v| v.parse());
    let (draws, first) = (number("--draws", 4)?, number("--first-seed", 1)?);
    let table = argument("--table").unwrap_or_else(|| "target/next_poke.csv".to_owned());
    let mut table = Table::<Row>::open(Path::new(&table))?;
    for (world, concealed) in (first..).filter_map(world).take(draws as usize) {
        let seed = world.seed;
        for choice in [Choice::Telling, Choice::Random(seed)] {
            let at_random = matches!(choice, Choice::Random(_));
            let of_draw = |row: &&Row| row.seed == seed;
            if table.rows.iter().filter(of_draw).any(|row| row.at_random == at_random) {
                continue;
            }
            // What the first pokes settle needs no others of either kind.
            let settled = table.rows.iter().find(of_draw).filter(|row| row.pokes == 0).cloned();
            let row = match settled {
                Some(settled) => Ok(Row { at_random, ..settled }),
                None => rounds(world.clone(), concealed, choice),
            };
            match row {
                Ok(row) => {
                    println!("{row:?}");
                    table.add(row)?;
                }
                Err(error) => {
                    eprintln!("seed {seed}: {error}");
                    break;
                }
            }
        }
    }
    let of = |at_random: bool| table.rows.iter().filter(move |row| row.at_random == at_random);
    let pairs: Vec<(&Row, &Row)> =
        of(false).filter_map(|told| Some((told, of(true).find(|row| row.seed == told.seed)?))).collect();
    let told: Vec<&(&Row, &Row)> = pairs
        .iter()
        .filter(|(a, b)| a.pokes.max(b.pokes) > 0 && a.needed().min(b.needed()).is_finite())
        .collect();
    println!(
        "{} draws, {} settled by their first pokes; of {} that more pokes told the median needed {:.1} that tell most, or {:.1} at random",
        pairs.len(),
        pairs.iter().filter(|(a, _)| a.pokes == 0).count(),
        told.len(),
        median(told.iter().map(|(a, _)| a.needed()).collect()),
        median(told.iter().map(|(_, b)| b.needed()).collect()),
    );
    Ok(())
}

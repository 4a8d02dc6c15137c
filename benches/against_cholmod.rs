//! One elastic block, written for another solver and solved by this one; `compare-cholmod.sh` runs it.
//!
//! Arguments: boxes along x, y and z, and the file for the matrix. File: `n`, number of entries (u64), column
//! starts (u32, n + 1), rows (u32), values (f64) of the lower triangle; little endian.
//! Output: one line `solver nodes analyse factor solve solve32 entries residual`, in seconds, best of the rounds.

mod elastic_block;

use elastic_block::{ElasticBlock, elastic_block};
use phantom_rig::sparse::{Analysis, Ordering};
use std::io::Write;
use std::time::Instant;

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [x, y, z, file, rounds] = arguments.as_slice() else {
        println!("arguments: boxes along x, y and z; file for the matrix; rounds. See compare-cholmod.sh");
        return Ok(());
    };
    let number = |text: &String| text.parse::<usize>().expect("a whole number");
    let cells = [x, y, z].map(number);
    let slab = elastic_block([0.15, 0.1, 0.025], cells, 0.1);
    write(&slab, file)?;

    let n = slab.position.len();
    let mut best = [f64::INFINITY; 4];
    let (mut entries, mut residual) = (0, 0.0);
    for _ in 0..number(rounds) {
        let clock = Instant::now();
        let ordering = Ordering::NestedDissection { position: &slab.position };
        let analysis = Analysis::new(slab.matrix.pattern(), ordering).expect("an order");
        let analysed = clock.elapsed();
        let factor = analysis.factor(&slab.matrix).expect("a clamped slab");
        let factored = clock.elapsed();
        let mut one = vec![1.0; n];
        factor.solve_in_place(&mut one, 1).expect("a fitting length");
        let solved = clock.elapsed();
        let mut many = vec![1.0; n * 32];
        let start_many = clock.elapsed();
        factor.solve_in_place(&mut many, 32).expect("a fitting length");
        let steps = [analysed, factored - analysed, solved - factored, clock.elapsed() - start_many];
        for (best, step) in best.iter_mut().zip(steps) {
            *best = best.min(step.as_secs_f64());
        }
        (entries, residual) = (analysis.factor_entries(), factor.probe_residual());
    }
    let nodes = cells.map(|c| c + 1).iter().product::<usize>();
    let [analyse, factor, solve, solve_many] = best;
    println!("ours {nodes} {analyse:.4} {factor:.4} {solve:.4} {solve_many:.4} {entries} {residual:.1e}");
    Ok(())
}

fn write(slab: &ElasticBlock, file: &str) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(file)?);
    let pattern = slab.matrix.pattern();
    for count in [pattern.dimension(), pattern.entries()] {
        out.write_all(&(count as u64).to_le_bytes())?;
    }
    for index in pattern.column_starts().iter().chain(pattern.rows()) {
        out.write_all(&index.to_le_bytes())?;
    }
    for value in slab.matrix.values() {
        out.write_all(&value.to_le_bytes())?;
    }
    out.flush()
}

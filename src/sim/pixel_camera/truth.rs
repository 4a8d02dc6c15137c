//! Where the dots of each picture truly were, beside the pictures.

use crate::sim::LiveBench;
use crate::sim::pixels::{Frame, PixelError};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// A table with a row for each dot of each frame: number of the frame, host time (ns) at which the row of its centre was exposed, number of
/// the dot, its centre in the phantom frame (m), and the share of it that nothing hides.
pub struct TruthTable {
    path: PathBuf,
    file: BufWriter<File>,
    bench: LiveBench,
}

impl TruthTable {
    /// Begins the table; a file that is there is replaced. Pictures are of `bench`.
    ///
    /// # Errors
    /// [`PixelError::Write`].
    pub fn create(path: PathBuf, bench: LiveBench) -> Result<Self, PixelError> {
        let failed = |source| PixelError::Write { path: path.clone(), source };
        let mut file = BufWriter::new(File::create(&path).map_err(failed)?);
        writeln!(file, "frame,host_time,dot,x,y,z,visible\n1,ns,1,m,m,m,1").map_err(failed)?;
        Ok(Self { path, file, bench })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// [`PixelError::Write`].
    pub fn add(&mut self, frame: &Frame) -> Result<(), PixelError> {
        for dot in &frame.dots {
            let host = self.bench.host(dot.time_s);
            let (number, [x, y, z]) = (dot.number, <[f64; 3]>::from(dot.position_m));
            let row =
                format!("{},{},{number},{x:.7},{y:.7},{z:.7},{:.3}", frame.number, host.nanos(), dot.visible);
            writeln!(self.file, "{row}")
                .map_err(|source| PixelError::Write { path: self.path.clone(), source })?;
        }
        Ok(())
    }
}

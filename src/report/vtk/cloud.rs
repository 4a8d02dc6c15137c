//! Points with fields as a `.vtp` file: markers, restraint patches.

use super::array::{Field, check_length, write_fields, write_head, write_i64, write_vectors};
use crate::geometry::Vec3;
use crate::report::ReportError;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a `.vtp` file of `points` (m), each one a vertex. A field of the wrong length is refused before
/// anything is written.
pub fn write_vtp(path: &Path, points: &[Vec3], fields: &[Field<'_>]) -> Result<(), ReportError> {
    fields.iter().try_for_each(|f| check_length(f, points.len()))?;
    let failed = |source| ReportError::Write { path: path.to_owned(), source };
    let mut out = BufWriter::new(File::create(path).map_err(failed)?);
    write(&mut out, points, fields).and_then(|()| out.flush()).map_err(failed)
}

fn write(out: &mut impl Write, points: &[Vec3], fields: &[Field<'_>]) -> io::Result<()> {
    let count = points.len();
    write_head(out, "PolyData")?;
    writeln!(out, "<PolyData>\n<Piece NumberOfPoints=\"{count}\" NumberOfVerts=\"{count}\">\n<Points>")?;
    write_vectors(out, "position_m", points)?;
    writeln!(out, "</Points>\n<Verts>")?;
    write_i64(out, "connectivity", 0..count as i64)?;
    write_i64(out, "offsets", 1..=count as i64)?;
    writeln!(out, "</Verts>\n<PointData>")?;
    write_fields(out, fields)?;
    writeln!(out, "</PointData>\n</Piece>\n</PolyData>\n</VTKFile>")
}

#[cfg(test)]
mod tests {
    use super::super::read_back::parse;
    use super::super::{Field, FieldValues};
    use super::*;

    #[test]
    fn a_cloud_reads_back_as_written() {
        let points = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(-1e-9, 4.0, 0.5)];
        let fields = [Field { name: "marker", values: FieldValues::Labels(&[7, 12]) }];
        let mut out = Vec::new();
        write(&mut out, &points, &fields).expect("memory");
        let parsed = parse(&String::from_utf8(out).expect("text"));
        assert_eq!(parsed.f64s("position_m"), [0.1, 0.2, 0.3, -1e-9, 4.0, 0.5]);
        assert_eq!(parsed.arrays["marker"].2, [7, 0, 0, 0, 12, 0, 0, 0]);
        assert_eq!(parsed.i64s("connectivity"), [0, 1]);
    }
}

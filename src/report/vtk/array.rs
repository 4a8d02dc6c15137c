//! How an array of numbers is written into a VTK XML file.
//!
//! Inline binary data, compressed: the bytes (little-endian) are cut into blocks of [`BLOCK`], each
//! deflated by zlib. Written are base64(header) and base64(all deflated blocks), where the header is, as 64-bit
//! integers: number of blocks, size of a whole block, size of the last block if it is a partial one (else 0),
//! deflated size of every block. Source: VTK file formats, "VTK XML Formats", section on compressed data.

use crate::geometry::Vec3;
use crate::report::ReportError;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::io::{self, Write};

/// Bytes of a block before it is deflated (the size that VTK itself uses).
pub(super) const BLOCK: usize = 32_768;

/// A named array carried by points or cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Field<'a> {
    /// Name, with its unit.
    pub name: &'a str,
    /// One entry a point or cell.
    pub values: FieldValues<'a>,
}

/// The entries of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues<'a> {
    /// One number each.
    Scalars(&'a [f64]),
    /// One vector each, in the phantom frame.
    Vectors(&'a [Vec3]),
    /// One label each: a group, a number by which something is named.
    Labels(&'a [u32]),
}

impl FieldValues<'_> {
    fn len(&self) -> usize {
        match self {
            Self::Scalars(values) => values.len(),
            Self::Vectors(values) => values.len(),
            Self::Labels(values) => values.len(),
        }
    }
}

/// Refuses a field that does not have one entry for each of `expected` points or cells.
pub(super) fn check_length(field: &Field<'_>, expected: usize) -> Result<(), ReportError> {
    match field.values.len() {
        values if values == expected => Ok(()),
        values => Err(ReportError::FieldLength { field: field.name.to_owned(), values, expected }),
    }
}

/// Writes the `DataArray` elements of `fields`.
pub(super) fn write_fields(out: &mut impl Write, fields: &[Field<'_>]) -> io::Result<()> {
    for field in fields {
        match field.values {
            FieldValues::Scalars(values) => write_f64(out, field.name, 1, values.iter().copied())?,
            FieldValues::Vectors(values) => write_vectors(out, field.name, values)?,
            FieldValues::Labels(values) => write_u32(out, field.name, values.iter().copied())?,
        }
    }
    Ok(())
}

/// Writes vectors as an array of three components.
pub(super) fn write_vectors(out: &mut impl Write, name: &str, values: &[Vec3]) -> io::Result<()> {
    write_f64(out, name, 3, values.iter().flat_map(|v| [v.x, v.y, v.z]))
}

/// Writes 64-bit integers: connectivity and offsets.
pub(super) fn write_i64(
    out: &mut impl Write,
    name: &str,
    values: impl Iterator<Item = i64>,
) -> io::Result<()> {
    write_array(out, "Int64", name, 1, &values.flat_map(i64::to_le_bytes).collect::<Vec<u8>>())
}

/// Writes bytes: cell types.
pub(super) fn write_u8(out: &mut impl Write, name: &str, values: &[u8]) -> io::Result<()> {
    write_array(out, "UInt8", name, 1, values)
}

fn write_u32(out: &mut impl Write, name: &str, values: impl Iterator<Item = u32>) -> io::Result<()> {
    write_array(out, "UInt32", name, 1, &values.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
}

fn write_f64(
    out: &mut impl Write,
    name: &str,
    components: usize,
    values: impl Iterator<Item = f64>,
) -> io::Result<()> {
    write_array(out, "Float64", name, components, &values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())
}

fn write_array(
    out: &mut impl Write,
    kind: &str,
    name: &str,
    components: usize,
    bytes: &[u8],
) -> io::Result<()> {
    let name = quick_xml::escape::escape(name);
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">{}</DataArray>",
        encode(bytes)?
    )
}

pub(super) fn encode(bytes: &[u8]) -> io::Result<String> {
    let blocks = bytes.len().div_ceil(BLOCK);
    let mut header = vec![blocks as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    let mut deflated = Vec::new();
    for block in bytes.chunks(BLOCK) {
        let before = deflated.len();
        // A seventh larger than by default, in half the time.
        let mut encoder = ZlibEncoder::new(&mut deflated, Compression::fast());
        encoder.write_all(block)?;
        encoder.finish()?;
        header.push((deflated.len() - before) as u64);
    }
    let header: Vec<u8> = header.into_iter().flat_map(u64::to_le_bytes).collect();
    Ok(STANDARD.encode(header) + &STANDARD.encode(deflated))
}

/// The opening tag of a file of the given kind.
pub(super) fn write_head(out: &mut impl Write, kind: &str) -> io::Result<()> {
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">"
    )
}

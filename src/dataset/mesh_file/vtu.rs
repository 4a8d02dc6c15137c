//! VTU files: XML → the arrays of one piece of an unstructured grid (VTK user's guide, "XML file formats").
//!
//! Raw appended data may hold any byte, so the XML reader stops where they begin.

use super::array::Values;
use super::assemble::RawMesh;
use super::vtk_grid::{GROUP_ARRAYS, Grid};
use super::vtu_data::{Appended, DataArray, Layout, decode};
use super::{MeshFileError, Place};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// What the XML of a file holds.
#[derive(Debug, Default)]
struct Document<'a> {
    layout: Layout,
    arrays: Vec<DataArray>,
    appended: Option<Appended<'a>>,
    pieces: usize,
}

/// Parses a file from its first byte.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, MeshFileError> {
    let document = read_xml(bytes)?;
    if document.pieces != 1 {
        return Err(unsupported(
            "the number of pieces",
            document.pieces.to_string(),
            "one piece (merge them when saving)",
        ));
    }
    let all =
        |array: &DataArray| decode(array, &document.layout, document.appended.as_ref(), &document.arrays);
    let find = |section: &str, name: &str| -> Result<Values, MeshFileError> {
        let found =
            document.arrays.iter().find(|a| a.section == section && (name.is_empty() || a.name == name));
        let missing =
            || MeshFileError::MissingSection { section: format!("<DataArray> {name} in <{section}>") };
        all(found.ok_or_else(missing)?)
    };
    let mut grid = Grid {
        points: find("Points", "")?.reals(),
        connectivity: find("Cells", "connectivity")?.whole("connectivity")?,
        ends: find("Cells", "offsets")?.whole("offsets")?,
        types: find("Cells", "types")?.whole("types")?,
        ..Grid::default()
    };
    for array in &document.arrays {
        if array.section == "CellData" && GROUP_ARRAYS.contains(&array.name.as_str()) {
            grid.groups = Some(all(array)?.whole(&array.name)?);
        } else if array.section == "FieldData" && array.scalar.is_some_and(|s| s.is_whole()) {
            grid.name_group(&array.name, &all(array)?);
        }
    }
    grid.into_raw()
}

fn read_xml(bytes: &[u8]) -> Result<Document<'_>, MeshFileError> {
    let mut reader = Reader::from_reader(bytes);
    let mut document = Document::default();
    let mut section = String::new();
    let mut open: Option<DataArray> = None;
    loop {
        let byte = reader.buffer_position();
        let xml = |message: String| MeshFileError::Xml { byte, message };
        let event = reader.read_event().map_err(|e| xml(e.to_string()))?;
        match event {
            Event::Start(ref tag) | Event::Empty(ref tag) => {
                let is_empty = matches!(event, Event::Empty(_));
                match tag.name().as_ref() {
                    "VTKFile" => document.layout = layout(tag, byte)?,
                    "Piece" => document.pieces += 1,
                    name @ ("Points" | "Cells" | "CellData" | "PointData" | "FieldData") => {
                        section = name.to_owned();
                    }
                    "DataArray" | "Array" => {
                        let array = data_array(tag, byte, &section)?;
                        if is_empty {
                            document.arrays.push(array);
                        } else {
                            open = Some(array);
                        }
                    }
                    "AppendedData" if !is_empty => {
                        let raw = match attribute(tag, "encoding", byte)?.as_deref() {
                            Some("raw") => true,
                            Some("base64") | None => false,
                            Some(other) => {
                                return Err(unsupported(
                                    "the encoding of appended data",
                                    other.to_owned(),
                                    "raw or base64",
                                ));
                            }
                        };
                        let start = usize::try_from(reader.buffer_position()).unwrap_or(bytes.len());
                        document.appended = Some(Appended::new(&bytes[start.min(bytes.len())..], raw)?);
                        return Ok(document);
                    }
                    _ => {}
                }
            }
            Event::Text(text) => {
                if let Some(array) = &mut open {
                    array.text.extend_from_slice(text.as_bytes());
                }
            }
            Event::CData(text) => {
                if let Some(array) = &mut open {
                    array.text.extend_from_slice(text.as_bytes());
                }
            }
            Event::End(tag) if matches!(tag.name().as_ref(), "DataArray" | "Array") => {
                document.arrays.extend(open.take());
            }
            Event::End(tag) if tag.name().as_ref() == "VTKFile" && document.pieces > 0 => {
                return Ok(document);
            }
            Event::Eof => {
                return Err(xml("the file ends before </VTKFile> (is it cut off?)".to_owned()));
            }
            _ => {}
        }
    }
}

fn layout(tag: &BytesStart<'_>, byte: u64) -> Result<Layout, MeshFileError> {
    match attribute(tag, "type", byte)?.as_deref() {
        Some("UnstructuredGrid") => {}
        other => {
            return Err(unsupported(
                "the VTK file type",
                other.unwrap_or_default().to_owned(),
                "UnstructuredGrid",
            ));
        }
    }
    match attribute(tag, "byte_order", byte)?.as_deref() {
        Some("LittleEndian") | None => {}
        Some(other) => return Err(unsupported("the byte order", other.to_owned(), "LittleEndian")),
    }
    let wide_headers = match attribute(tag, "header_type", byte)?.as_deref() {
        Some("UInt64") => true,
        Some("UInt32") | None => false,
        Some(other) => return Err(unsupported("the header type", other.to_owned(), "UInt32 or UInt64")),
    };
    let compressed = match attribute(tag, "compressor", byte)?.as_deref() {
        Some("vtkZLibDataCompressor") => true,
        Some("") | None => false,
        Some(other) => {
            return Err(unsupported("the compressor", other.to_owned(), "vtkZLibDataCompressor or none"));
        }
    };
    Ok(Layout { wide_headers, compressed })
}

fn data_array(tag: &BytesStart<'_>, byte: u64, section: &str) -> Result<DataArray, MeshFileError> {
    let text = |key| attribute(tag, key, byte).map(Option::unwrap_or_default);
    let kind = text("type")?;
    Ok(DataArray {
        section: section.to_owned(),
        name: text("Name")?,
        scalar: super::array::Scalar::of_vtu(&kind),
        kind,
        format: text("format")?,
        offset: text("offset")?.parse().ok(),
        text: Vec::new(),
    })
}

fn attribute(tag: &BytesStart<'_>, key: &str, byte: u64) -> Result<Option<String>, MeshFileError> {
    let found =
        tag.try_get_attribute(key).map_err(|e| MeshFileError::Xml { byte, message: e.to_string() })?;
    Ok(found.map(|a| a.value.into_owned()))
}

fn unsupported(what: &'static str, found: String, expected: &'static str) -> MeshFileError {
    MeshFileError::Unsupported { at: Place::Line(1), what, found, expected }
}

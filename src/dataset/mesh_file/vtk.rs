//! Legacy VTK files, version 2.0 to 5.1, ASCII and binary (VTK user's guide, "VTK file formats").
//!
//! A file is a header of three lines and then a stream of words: a keyword, what it announces, its numbers.

use super::array::{Scalar, Values};
use super::assemble::RawMesh;
use super::cursor::{Cursor, Encoding};
use super::vtk_grid::{GROUP_ARRAYS, Grid};
use super::{MeshFileError, Place};

/// What the arrays being read belong to.
#[derive(Clone, Copy, PartialEq)]
enum Owner {
    /// The grid as a whole.
    Field,
    /// This many cells.
    Cells(u64),
    /// This many points.
    Points(u64),
}

/// Parses a file from its first byte.
pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, MeshFileError> {
    let mut cursor = Cursor::new(bytes);
    let major = header(&mut cursor)?;
    let mut grid = Grid::default();
    let mut owner = Owner::Field;
    while let Some(word) = cursor.word() {
        let keyword = String::from_utf8_lossy(word).to_ascii_uppercase();
        cursor.section = keyword.clone();
        match keyword.as_str() {
            "POINTS" => {
                let count: u64 = cursor.parsed("the number of points")?;
                let scalar = scalar(&mut cursor)?;
                let count = product(&cursor, count, 3)?;
                grid.points = values(&mut cursor, scalar, count)?.reals();
            }
            "CELLS" => cells(&mut cursor, &mut grid, major)?,
            "CELL_TYPES" => {
                let count = cursor.parsed("the number of cells")?;
                grid.types = values(&mut cursor, Scalar::I32, count)?.whole("CELL_TYPES")?;
            }
            "CELL_DATA" => owner = Owner::Cells(cursor.parsed("the number of cells")?),
            "POINT_DATA" => owner = Owner::Points(cursor.parsed("the number of points")?),
            "FIELD" => field(&mut cursor, &mut grid, owner)?,
            "METADATA" => while cursor.line().is_some_and(|line| !line.is_empty()) {},
            _ => attribute(&mut cursor, &mut grid, owner, &keyword)?,
        }
    }
    for (name, found) in [("POINTS", grid.points.is_empty()), ("CELL_TYPES", grid.types.is_empty())] {
        if found {
            return Err(MeshFileError::MissingSection { section: name.to_owned() });
        }
    }
    grid.into_raw()
}

/// Reads the three lines of the header and the kind of the data set; returns the major version.
fn header(cursor: &mut Cursor<'_>) -> Result<u32, MeshFileError> {
    let unsupported = |line, what, found: &str, expected| MeshFileError::Unsupported {
        at: Place::Line(line),
        what,
        found: found.to_owned(),
        expected,
    };
    let mut line = || cursor.line().map(|l| String::from_utf8_lossy(l).into_owned()).unwrap_or_default();
    let (first, _title, encoding) = (line(), line(), line());
    let version = first.rsplit(' ').next().unwrap_or_default();
    let major = match version.split('.').next().and_then(|v| v.parse().ok()) {
        Some(major @ 2..=5) => major,
        _ => return Err(unsupported(1, "the VTK version", version, "2.0 to 5.1")),
    };
    match encoding.to_ascii_uppercase().as_str() {
        "ASCII" => {}
        "BINARY" => cursor.encoding = Encoding::BigEndian,
        _ => return Err(unsupported(3, "the encoding", &encoding, "ASCII or BINARY")),
    }
    let dataset = cursor.text("DATASET")?;
    if !dataset.eq_ignore_ascii_case("DATASET") {
        return Err(cursor.unexpected(dataset, "DATASET"));
    }
    let kind = cursor.text("the kind of the data set")?;
    if !kind.eq_ignore_ascii_case("UNSTRUCTURED_GRID") {
        return Err(unsupported(4, "the data set", kind, "UNSTRUCTURED_GRID"));
    }
    Ok(major)
}

/// Reads `CELLS`: before version 5 each cell is a count and its points; from 5 on offsets and points are
/// separate arrays.
fn cells(cursor: &mut Cursor<'_>, grid: &mut Grid, major: u32) -> Result<(), MeshFileError> {
    let count: u64 = cursor.parsed("the number of cells")?;
    let size: u64 = cursor.parsed("the size of the cell list")?;
    if major >= 5 {
        let mut array = |name: &'static str, count: u64| {
            let word = cursor.text(name)?;
            if word != name {
                return Err(cursor.unexpected(word, name));
            }
            let scalar = scalar(cursor)?;
            values(cursor, scalar, count)?.whole(name)
        };
        // Offsets begin with 0 and end with the length of the connectivity.
        grid.ends = array("OFFSETS", count)?.split_off(usize::from(count > 0));
        grid.connectivity = array("CONNECTIVITY", size)?;
        return Ok(());
    }
    let list = values(cursor, Scalar::I32, size)?.whole("CELLS")?;
    let mut rest = &list[..];
    while let [points, tail @ ..] = rest {
        let cell = usize::try_from(*points).ok().and_then(|n| tail.split_at_checked(n));
        let Some((corners, tail)) = cell else {
            return Err(cursor.unexpected(points.to_string(), "the number of points of a cell in the list"));
        };
        grid.connectivity.extend(corners);
        grid.ends.push(grid.connectivity.len() as i64);
        rest = tail;
    }
    let found = grid.ends.len();
    if found as u64 != count {
        return Err(MeshFileError::WrongLength {
            array: "CELLS".to_owned(),
            found,
            expected: count as usize,
        });
    }
    Ok(())
}

/// Reads `FIELD`: any number of arrays, each with its name, components, tuples and type.
fn field(cursor: &mut Cursor<'_>, grid: &mut Grid, owner: Owner) -> Result<(), MeshFileError> {
    cursor.text("the name of the field")?;
    let count: u64 = cursor.parsed("the number of arrays")?;
    for _ in 0..cursor.fits(count, 8)? {
        let name = decoded(cursor.text("the name of an array")?);
        if name == "METADATA" {
            return Err(cursor.unexpected(name, "the name of an array"));
        }
        let components: u64 = cursor.parsed("the number of components")?;
        let tuples: u64 = cursor.parsed("the number of tuples")?;
        let kind = cursor.text("a type of numbers")?;
        let count = product(cursor, components, tuples)?;
        if kind.eq_ignore_ascii_case("string") {
            // Strings stand one a line in ASCII; what binary files do with them is not read.
            if cursor.encoding != Encoding::Ascii {
                return Err(cursor.unexpected(kind, "numbers"));
            }
            cursor.line();
            for _ in 0..cursor.fits(count, 1)? {
                cursor.line();
            }
            continue;
        }
        let scalar = Scalar::of_legacy(kind).ok_or_else(|| cursor.unexpected(kind, "a type of numbers"))?;
        let values = values(cursor, scalar, count)?;
        store(grid, owner, &name, values)?;
        skip_metadata(cursor);
    }
    Ok(())
}

/// Reads one of the older attribute keywords, of which only `SCALARS` of cells can matter.
fn attribute(
    cursor: &mut Cursor<'_>,
    grid: &mut Grid,
    owner: Owner,
    keyword: &str,
) -> Result<(), MeshFileError> {
    let (Owner::Cells(tuples) | Owner::Points(tuples)) = owner else {
        return Err(cursor.unexpected(keyword, "a keyword such as POINTS or CELLS"));
    };
    let name = decoded(cursor.text("the name of an array")?);
    let ascii = cursor.encoding == Encoding::Ascii;
    let (scalar, components) = match keyword {
        "SCALARS" => {
            let scalar = scalar(cursor)?;
            // The number of components may be left out; the rest of the line holds it or nothing.
            let components = cursor.line().unwrap_or_default();
            let components = String::from_utf8_lossy(components).into_owned();
            let components = if components.is_empty() { Some(1) } else { components.parse().ok() }
                .ok_or_else(|| {
                    cursor.unexpected(components.as_str(), "the number of components, or nothing")
                })?;
            let table = cursor.text("LOOKUP_TABLE")?;
            if table != "LOOKUP_TABLE" {
                return Err(cursor.unexpected(table, "LOOKUP_TABLE"));
            }
            cursor.text("the name of the lookup table")?;
            (scalar, components)
        }
        "VECTORS" | "NORMALS" => (scalar(cursor)?, 3),
        "TENSORS" => (scalar(cursor)?, 9),
        "TENSORS6" => (scalar(cursor)?, 6),
        "GLOBAL_IDS" | "PEDIGREE_IDS" => (scalar(cursor)?, 1),
        "TEXTURE_COORDINATES" => {
            let components = cursor.parsed("the number of components")?;
            (scalar(cursor)?, components)
        }
        "COLOR_SCALARS" => {
            let components = cursor.parsed("the number of components")?;
            (if ascii { Scalar::F32 } else { Scalar::U8 }, components)
        }
        "LOOKUP_TABLE" => {
            let size = cursor.parsed("the size of the lookup table")?;
            let count = product(cursor, size, 4)?;
            values(cursor, if ascii { Scalar::F32 } else { Scalar::U8 }, count)?;
            return Ok(());
        }
        _ => return Err(cursor.unexpected(keyword, "a keyword of the format such as SCALARS or FIELD")),
    };
    let count = product(cursor, components, tuples)?;
    let values = values(cursor, scalar, count)?;
    store(grid, owner, &name, values)
}

/// Keeps an array that says something about groups.
fn store(grid: &mut Grid, owner: Owner, name: &str, values: Values) -> Result<(), MeshFileError> {
    match owner {
        Owner::Field => grid.name_group(name, &values),
        Owner::Cells(_) if GROUP_ARRAYS.contains(&name) => grid.groups = Some(values.whole(name)?),
        Owner::Cells(_) | Owner::Points(_) => {}
    }
    Ok(())
}

fn scalar(cursor: &mut Cursor<'_>) -> Result<Scalar, MeshFileError> {
    let name = cursor.text("a type of numbers")?;
    Scalar::of_legacy(name).ok_or_else(|| cursor.unexpected(name, "a type such as int or double"))
}

fn product(cursor: &Cursor<'_>, a: u64, b: u64) -> Result<u64, MeshFileError> {
    a.checked_mul(b).ok_or_else(|| cursor.unexpected(format!("{a} × {b}"), "an array that fits the file"))
}

/// Reads `count` numbers behind the line that announces them.
fn values(cursor: &mut Cursor<'_>, scalar: Scalar, count: u64) -> Result<Values, MeshFileError> {
    if cursor.encoding != Encoding::Ascii {
        cursor.line();
        let count = cursor.fits(count, scalar.size())?;
        let bytes = cursor.slice(count * scalar.size(), "the numbers of an array")?;
        return Ok(scalar.decode(bytes, true));
    }
    let count = cursor.fits(count, 2)?;
    Ok(if scalar.is_whole() {
        Values::Whole((0..count).map(|_| cursor.parsed("a whole number")).collect::<Result<_, _>>()?)
    } else {
        Values::Real((0..count).map(|_| cursor.parsed("a number")).collect::<Result<_, _>>()?)
    })
}

/// Skips the `METADATA` block that newer writers put behind an array, if there is one.
fn skip_metadata(cursor: &mut Cursor<'_>) {
    let mut ahead = cursor.clone();
    if ahead.word() == Some(b"METADATA") {
        ahead.line();
        while ahead.line().is_some_and(|line| !line.is_empty()) {}
        *cursor = ahead;
    }
}

/// A name with its `%20` and the like decoded.
fn decoded(name: &str) -> String {
    let mut out = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail.get(..2).and_then(|h| std::str::from_utf8(h).ok());
        match code.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(byte) if *first == b'%' => {
                out.push(byte);
                rest = &tail[2..];
            }
            _ => {
                out.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

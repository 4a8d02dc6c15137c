//! One `<DataArray>` of a VTU file → its numbers: ASCII, base64 or appended, compressed or not.
//!
//! Binary data begin with a header of 32- or 64-bit numbers: uncompressed, the count of bytes; compressed, the
//! count of blocks, the size of a block, the size of the last block if it is shorter (else 0), and the
//! compressed size of each block. Base64 encodes header and data in one piece or in two; both are read, since
//! padding ends a piece.

use super::MeshFileError;
use super::array::{Scalar, Values};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use std::borrow::Cow;
use std::io::Read;

/// How a file lays out its binary data.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    /// Headers are of 64-bit numbers, not of 32-bit ones.
    pub(super) wide_headers: bool,
    /// Data are zlib-compressed in blocks.
    pub(super) compressed: bool,
}

/// One array as it stands in the XML.
#[derive(Debug)]
pub(super) struct DataArray {
    /// The element that it belongs to.
    pub(super) section: String,
    pub(super) name: String,
    /// Its type in words.
    pub(super) kind: String,
    /// Its type; `None` for text and unknown types.
    pub(super) scalar: Option<Scalar>,
    /// `ascii`, `binary` or `appended`.
    pub(super) format: String,
    /// Where its data begin among the appended ones.
    pub(super) offset: Option<usize>,
    /// What stands inside the element.
    pub(super) text: Vec<u8>,
}

/// The data appended to the file.
#[derive(Debug)]
pub(super) struct Appended<'a> {
    bytes: &'a [u8],
    raw: bool,
}

impl<'a> Appended<'a> {
    /// `rest` is the file from behind the opening tag; the data begin behind an underscore.
    pub(super) fn new(rest: &'a [u8], raw: bool) -> Result<Self, MeshFileError> {
        let start = rest.trim_ascii_start();
        let Some(bytes) = start.strip_prefix(b"_") else {
            return Err(MeshFileError::MissingSection {
                section: "underscore before the appended data".to_owned(),
            });
        };
        let end = if raw { None } else { bytes.iter().position(|&b| b == b'<') };
        Ok(Self { bytes: &bytes[..end.unwrap_or(bytes.len())], raw })
    }
}

/// The numbers of `array`. `arrays` are all of the file: base64 data end where the next array's begin.
pub(super) fn decode(
    array: &DataArray,
    layout: &Layout,
    appended: Option<&Appended<'_>>,
    arrays: &[DataArray],
) -> Result<Values, MeshFileError> {
    let scalar = array.scalar.ok_or_else(|| wrong(array, &array.kind, "a type such as Int32 or Float64"))?;
    let stream: Cow<'_, [u8]> = match array.format.as_str() {
        "ascii" => return words(array, scalar),
        "binary" => base64(array, &array.text)?.into(),
        "appended" => {
            let missing = || MeshFileError::MissingSection { section: "<AppendedData>".to_owned() };
            let appended = appended.ok_or_else(missing)?;
            let start = array.offset.ok_or_else(|| wrong(array, "", "an offset"))?;
            let rest = appended.bytes.get(start..).ok_or_else(|| cut_off(array))?;
            if appended.raw {
                rest.into()
            } else {
                let next = arrays.iter().filter_map(|a| a.offset).filter(|&o| o > start).min();
                let length = next.map_or(rest.len(), |n| (n - start).min(rest.len()));
                base64(array, &rest[..length])?.into()
            }
        }
        other => return Err(wrong(array, other, "the format ascii, binary or appended")),
    };
    let payload = if layout.compressed {
        Cow::from(decompress(array, layout, &stream)?)
    } else {
        let (header, data) = header(array, layout, &stream, 1)?;
        Cow::from(usize::try_from(header[0]).ok().and_then(|n| data.get(..n)).ok_or_else(|| cut_off(array))?)
    };
    let values = scalar.decode(&payload, false);
    let expected = payload.len() / scalar.size();
    if payload.len() % scalar.size() == 0 {
        Ok(values)
    } else {
        Err(wrong_length(array, &values, expected + 1))
    }
}

fn words(array: &DataArray, scalar: Scalar) -> Result<Values, MeshFileError> {
    let text = std::str::from_utf8(&array.text).map_err(|_| wrong(array, "bytes", "UTF-8 text"))?;
    let words = text.split_ascii_whitespace();
    Ok(if scalar.is_whole() {
        Values::Whole(
            words
                .map(|w| w.parse().map_err(|_| wrong(array, w, "a whole number")))
                .collect::<Result<_, _>>()?,
        )
    } else {
        Values::Real(
            words.map(|w| w.parse().map_err(|_| wrong(array, w, "a number"))).collect::<Result<_, _>>()?,
        )
    })
}

/// Bytes of base64 text, which may be several padded pieces one after the other.
fn base64(array: &DataArray, text: &[u8]) -> Result<Vec<u8>, MeshFileError> {
    let text: Vec<u8> = text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let mut rest = &text[..];
    while !rest.is_empty() {
        let body = rest.iter().position(|&b| b == b'=').unwrap_or(rest.len());
        let padding = rest[body..].iter().take_while(|&&b| b == b'=').count();
        let (piece, tail) = rest.split_at(body + padding);
        STANDARD
            .decode_vec(piece, &mut bytes)
            .map_err(|e| MeshFileError::Base64 { array: array.name.clone(), message: e.to_string() })?;
        rest = tail;
    }
    Ok(bytes)
}

/// The first `count` numbers of the header, and the bytes behind them.
fn header<'s>(
    array: &DataArray,
    layout: &Layout,
    stream: &'s [u8],
    count: usize,
) -> Result<(Vec<u64>, &'s [u8]), MeshFileError> {
    let size = if layout.wide_headers { 8 } else { 4 };
    let (head, data) =
        count.checked_mul(size).and_then(|n| stream.split_at_checked(n)).ok_or_else(|| cut_off(array))?;
    let number = |chunk: &[u8]| chunk.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
    Ok((head.chunks_exact(size).map(number).collect(), data))
}

fn decompress(array: &DataArray, layout: &Layout, stream: &[u8]) -> Result<Vec<u8>, MeshFileError> {
    let (head, _) = header(array, layout, stream, 3)?;
    let (blocks, size, last) = (head[0], head[1], head[2]);
    let count = usize::try_from(blocks).ok().and_then(|b| b.checked_add(3)).ok_or_else(|| cut_off(array))?;
    let (head, mut data) = header(array, layout, stream, count)?;
    let mut bytes = Vec::new();
    for (block, &length) in head[3..].iter().enumerate() {
        let split = usize::try_from(length).ok().and_then(|n| data.split_at_checked(n));
        let (packed, tail) = split.ok_or_else(|| cut_off(array))?;
        data = tail;
        let is_last = block + 1 == head.len() - 3;
        let expected = if is_last && last != 0 { last } else { size };
        let before = bytes.len();
        // One byte more than promised is enough to know that the promise is wrong.
        let limit = expected.saturating_add(1);
        let unpacked = ZlibDecoder::new(packed).take(limit).read_to_end(&mut bytes);
        let found = bytes.len() - before;
        if unpacked.is_err() || found as u64 != expected {
            let expected = usize::try_from(expected).unwrap_or(usize::MAX);
            return Err(MeshFileError::Compression { array: array.name.clone(), block, found, expected });
        }
    }
    Ok(bytes)
}

fn section(array: &DataArray) -> String {
    format!("<DataArray> {} in <{}>", array.name, array.section)
}

fn wrong(array: &DataArray, found: &str, expected: &str) -> MeshFileError {
    MeshFileError::UnexpectedInArray {
        array: section(array),
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}

fn cut_off(array: &DataArray) -> MeshFileError {
    MeshFileError::ArrayCutOff { array: section(array) }
}

fn wrong_length(array: &DataArray, values: &Values, expected: usize) -> MeshFileError {
    MeshFileError::WrongLength { array: section(array), found: values.len(), expected }
}

//! What a VTK XML file holds, read independently of the code that writes it (for tests only).

use super::array::{BLOCK, encode};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use quick_xml::Reader;
use quick_xml::events::Event;
use std::collections::BTreeMap;
use std::io::Read;

/// Type, number of components and bytes of every array by name; counts of the piece by attribute.
pub(super) struct Parsed {
    pub(super) arrays: BTreeMap<String, (String, usize, Vec<u8>)>,
    pub(super) piece: BTreeMap<String, usize>,
}

impl Parsed {
    pub(super) fn f64s(&self, name: &str) -> Vec<f64> {
        let (kind, _, bytes) = &self.arrays[name];
        assert_eq!(kind, "Float64");
        bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
    }

    pub(super) fn i64s(&self, name: &str) -> Vec<i64> {
        let (kind, _, bytes) = &self.arrays[name];
        assert_eq!(kind, "Int64");
        bytes.chunks(8).map(|b| i64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
    }
}

pub(super) fn parse(text: &str) -> Parsed {
    let mut reader = Reader::from_str(text);
    let mut parsed = Parsed { arrays: BTreeMap::new(), piece: BTreeMap::new() };
    let mut open: Option<BTreeMap<String, String>> = None;
    loop {
        match reader.read_event().expect("well-formed XML") {
            Event::Start(tag) => {
                let attributes: BTreeMap<String, String> = tag
                    .attributes()
                    .map(|a| {
                        let a = a.expect("an attribute");
                        let key = a.key.as_ref().to_owned();
                        let raw = a.value.to_string();
                        (key, quick_xml::escape::unescape(&raw).expect("escaped").into_owned())
                    })
                    .collect();
                match tag.name().as_ref() {
                    "Piece" => {
                        let counts = attributes.iter().map(|(k, v)| (k.clone(), v.parse().expect("count")));
                        parsed.piece = counts.collect();
                    }
                    "DataArray" => open = Some(attributes),
                    _ => {}
                }
            }
            Event::Text(text) => {
                if let Some(a) = open.take() {
                    let bytes = decode(&text);
                    let components = a["NumberOfComponents"].parse().expect("a count");
                    parsed.arrays.insert(a["Name"].clone(), (a["type"].clone(), components, bytes));
                }
            }
            Event::End(_) => open = None,
            Event::Eof => return parsed,
            _ => {}
        }
    }
}

/// Decodes the way VTK does: the first word says how long the base64 of the header is.
fn decode(text: &str) -> Vec<u8> {
    let word = |bytes: &[u8], i: usize| {
        u64::from_le_bytes(bytes[8 * i..8 * (i + 1)].try_into().expect("eight bytes")) as usize
    };
    let blocks = word(&STANDARD.decode(&text[..12]).expect("base64"), 0);
    let header_length = (8 * (3 + blocks)).div_ceil(3) * 4;
    let header = STANDARD.decode(&text[..header_length]).expect("a header");
    let data = STANDARD.decode(&text[header_length..]).expect("base64 data");
    let (whole, partial) = (word(&header, 1), word(&header, 2));
    let (mut at, mut bytes) = (0, Vec::new());
    for block in 0..blocks {
        let size = word(&header, 3 + block);
        let mut plain = Vec::new();
        flate2::read::ZlibDecoder::new(&data[at..at + size]).read_to_end(&mut plain).expect("zlib");
        let last = block + 1 == blocks && partial > 0;
        assert_eq!(plain.len(), if last { partial } else { whole });
        bytes.extend(plain);
        at += size;
    }
    assert_eq!(at, data.len());
    bytes
}

#[test]
fn arrays_survive_at_every_block_boundary() {
    for length in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK, 3 * BLOCK + 17] {
        let bytes: Vec<u8> = (0..length).map(|i| (i * i % 251) as u8).collect();
        assert_eq!(decode(&encode(&bytes).expect("memory")), bytes, "{length} bytes");
    }
}

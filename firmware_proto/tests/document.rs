//! Does the written protocol say what the source does? Its tables are printed here from the source's own and
//! compared with the file; where they differ, the failure shows what the file should hold.

use std::fmt::Write;

use firmware_proto::{CODE_LISTS, Field, HEADER, Layout, RECORDS, Request, Response, SCHEMA_HASH};

const DOCUMENT: &str = include_str!("../src/protocol.md");

fn fields(fields: &[Field], first: usize) -> String {
    let mut table = String::from("| byte | field | type | unit | meaning |\n|---|---|---|---|---|\n");
    let mut at = first;
    for Field { name, kind, bytes, unit, meaning } in fields {
        let _ = writeln!(table, "| {at} | `{name}` | {kind} | {unit} |{meaning} |");
        at += bytes;
    }
    table
}

fn messages(layouts: &[Layout]) -> String {
    let mut text = String::new();
    for Layout { kind, name, meaning, fields: payload } in layouts {
        let bytes: usize = payload.iter().map(|field| field.bytes).sum();
        let _ = writeln!(text, "**0x{kind:02X} {name}**, {bytes} bytes:{meaning}\n");
        if !payload.is_empty() {
            let _ = writeln!(text, "{}", fields(payload, 0));
        }
    }
    text
}

fn header() -> String {
    let mut table = fields(HEADER, 0);
    table.push_str("| 11 | payload | see below | | at most 79 bytes |\n");
    table.push_str("| 11 + payload | checksum | u32 | – | CRC-32C of all bytes before it |\n");
    table
}

fn records() -> String {
    RECORDS.iter().fold(String::new(), |mut text, record| {
        let bytes: usize = record.fields.iter().map(|field| field.bytes).sum();
        let _ = writeln!(text, "**{}**, {bytes} bytes\n\n{}", record.name, fields(record.fields, 0));
        text
    })
}

fn codes() -> String {
    CODE_LISTS.iter().fold(String::new(), |mut text, list| {
        let _ = writeln!(text, "**{}**\n\n| code | name | meaning |\n|---|---|---|", list.name);
        for code in list.codes {
            let _ = writeln!(text, "| {} | `{}` |{} |", code.code, code.name, code.meaning);
        }
        text.push('\n');
        text
    })
}

fn assert_block(name: &str, expected: &str) {
    let (begin, end) = (format!("<!-- begin {name} -->\n"), format!("<!-- end {name} -->"));
    let written = DOCUMENT.split_once(&begin).and_then(|(_, rest)| rest.split_once(&end));
    let written = written.expect("the document has both markers").0;
    assert!(
        written.trim() == expected.trim(),
        "protocol.md between the markers of {name} should read:\n{expected}\n-- end of {name} --"
    );
}

#[test]
fn header_is_documented() {
    assert_block("header", &header());
}

#[test]
fn requests_are_documented() {
    assert_block("requests", &messages(Request::TABLE));
}

#[test]
fn responses_are_documented() {
    assert_block("responses", &messages(Response::TABLE));
}

#[test]
fn records_are_documented() {
    assert_block("records", &records());
}

#[test]
fn codes_are_documented() {
    assert_block("codes", &codes());
}

#[test]
fn kinds_tell_direction_and_occur_once() {
    let kinds: Vec<u8> = Request::TABLE.iter().chain(Response::TABLE).map(|layout| layout.kind).collect();
    for (at, kind) in kinds.iter().enumerate() {
        assert!(!kinds[..at].contains(kind), "kind {kind:#04x} occurs twice");
    }
    assert!(Request::TABLE.iter().all(|layout| layout.kind & 0x80 == 0));
    assert!(Response::TABLE.iter().all(|layout| layout.kind & 0x80 != 0));
}

/// The hash by its definition, over the tables as the document lists them.
#[test]
fn schema_hash_covers_names_codes_types_units_and_order() {
    let mut bytes = vec![firmware_proto::MAJOR];
    let text = |bytes: &mut Vec<u8>, text: &str| {
        bytes.extend(text.as_bytes());
        bytes.push(0);
    };
    let row = |bytes: &mut Vec<u8>, fields: &[Field]| {
        for field in fields {
            text(bytes, field.name);
            text(bytes, field.kind);
            bytes.push(field.bytes as u8);
            text(bytes, field.unit);
        }
        bytes.push(0);
    };
    row(&mut bytes, HEADER);
    for layout in Request::TABLE.iter().chain(Response::TABLE) {
        bytes.push(layout.kind);
        text(&mut bytes, layout.name);
        row(&mut bytes, layout.fields);
    }
    for record in RECORDS {
        text(&mut bytes, record.name);
        row(&mut bytes, record.fields);
    }
    for list in CODE_LISTS {
        text(&mut bytes, list.name);
        for code in list.codes {
            bytes.push(code.code);
            text(&mut bytes, code.name);
        }
    }
    assert_eq!(fnv_1a(&bytes), SCHEMA_HASH);
    // Its authors' own example: the hash of "foobar".
    assert_eq!(fnv_1a(b"foobar"), 0x8594_4171_f739_67e8);
}

fn fnv_1a(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3))
}

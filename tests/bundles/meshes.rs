//! Every mesh format gives the same mesh, refuses what it can't read by name, and survives damage.

use crate::mesh_writers::{STYLES, Style, cube, msh2, msh4, vtk, vtu};
use crate::{fixture, mesh_writers};
use phantom_rig::dataset::{DatasetError, MeshFileError, parse_mesh, read_bundle, write_bundle, write_msh};
use phantom_rig::mesh::TetMesh;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::OnceLock;

/// One file of every format and encoding.
fn files() -> &'static [(String, Vec<u8>)] {
    static FILES: OnceLock<Vec<(String, Vec<u8>)>> = OnceLock::new();
    FILES.get_or_init(write_files)
}

fn write_files() -> Vec<(String, Vec<u8>)> {
    let mesh = cube();
    let mut files = Vec::new();
    for binary in [false, true] {
        files.push((format!("MSH 2.2, binary: {binary}"), msh2(&mesh, binary)));
        files.push((format!("MSH 4.1, binary: {binary}"), msh4(&mesh, binary)));
        for major in [3, 4, 5] {
            files.push((format!("VTK {major}, binary: {binary}"), vtk(&mesh, major, binary)));
        }
    }
    files.extend(STYLES.map(|style| (format!("VTU {style:?}"), vtu(&mesh, style))));
    files
}

/// A triangle beginning with its smallest node, so that only its sense of rotation is compared.
fn rotated(mut face: [u32; 3]) -> [u32; 3] {
    while face[0] != *face.iter().min().expect("three") {
        face.rotate_left(1);
    }
    face
}

fn assert_same(name: &str, found: &TetMesh, expected: &TetMesh) {
    assert_eq!(found.nodes, expected.nodes, "{name}: nodes, without the unused one");
    assert_eq!(found.tets, expected.tets, "{name}");
    let faces = |mesh: &TetMesh| -> Vec<(String, Vec<[u32; 3]>)> {
        mesh.surfaces.iter().map(|(n, f)| (n.clone(), f.iter().copied().map(rotated).collect())).collect()
    };
    assert_eq!(faces(found), faces(expected), "{name}: surfaces, all turned outward");
}

#[test]
fn every_format_gives_the_same_mesh() {
    for (name, bytes) in files() {
        let found = parse_mesh(bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_same(name, &found, &cube());
    }
}

#[test]
fn windows_line_ends_and_a_mark_are_accepted_in_text() {
    for (name, bytes) in files() {
        let Ok(text) = String::from_utf8(bytes.clone()) else { continue };
        let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        if !name.contains("binary: true") {
            let found = parse_mesh(windows.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_same(name, &found, &cube());
        }
        let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert!(matches!(parse_mesh(&utf16), Err(MeshFileError::Utf16)), "{name}");
    }
}

#[test]
fn a_bundle_takes_the_mesh_that_it_has() {
    let recording = fixture::recording();
    for (name, bytes) in [
        ("mesh.vtu", vtu(&recording.mesh, Style::AppendedRawZlib)),
        ("mesh.vtk", vtk(&recording.mesh, 5, true)),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        write_bundle(&recording, folder.path()).expect("writable");
        std::fs::remove_file(folder.path().join("mesh.msh")).expect("there");
        std::fs::write(folder.path().join(name), bytes).expect("writable");
        let (read, _) = read_bundle(folder.path()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_same(name, &read.mesh, &recording.mesh);
        // With mesh.msh beside it, mesh.msh counts.
        std::fs::write(folder.path().join("mesh.msh"), "nonsense").expect("writable");
        let error = read_bundle(folder.path()).expect_err("mesh.msh is read first");
        assert!(matches!(&error, DatasetError::Mesh { file, .. } if file.ends_with("mesh.msh")), "{error}");
    }
}

/// Replaces text in a file and returns the refusal.
fn refused(bytes: Vec<u8>, from: &str, to: &str) -> String {
    let text = String::from_utf8(bytes).expect("a file of text");
    assert!(text.contains(from), "{from:?} is not in the file");
    parse_mesh(text.replacen(from, to, 1).as_bytes()).expect_err("spoilt").to_string()
}

#[test]
fn what_is_not_read_is_refused_by_its_name() {
    let mesh = cube();
    let ascii = |style| vtu(&mesh, style);
    for (bytes, from, to, words) in [
        (msh4(&mesh, false), "4.1 0 8", "4.0 0 8", "the MSH version is \"4.0\"; expected 2.2 or 4.1"),
        (msh2(&mesh, false), "2.2 0 8", "2.2 0 4", "the data size is \"4\"; expected 8"),
        (msh2(&mesh, false), "$EndNodes", "$EndNode", "expected $EndNodes"),
        (msh2(&mesh, false), "0.02", "0.o2", "row 21, in $Nodes: \"0.o2\""),
        (msh2(&mesh, false), "0.02", "nan", "coordinates"),
        (msh2(&mesh, false), "100 9.0", "97 9.0", "node 97 stands there twice"),
        (msh2(&mesh, false), "\n8 4 2 1", "\n8 11 2 1", "second-order tetrahedron"),
        (msh2(&mesh, false), "\n8 4 2 1", "\n8 6 2 1", "prism"),
        (msh2(&mesh, false), "\n8 4 2 1 7 97", "\n8 4 2 1 7 96", "element 8 names node 96"),
        (msh2(&mesh, false), "\"phantom\"", "\"ghost\"", "no physical volume \"phantom\""),
        (
            msh2(&mesh, false),
            "\n2 2 2 10 7 97",
            "\n2 2 2 10 7 100",
            "surface \"fixed\": triangle 0 is not on the phantom",
        ),
        (msh4(&mesh, false), "$Entities", "$PartitionedEntities", "not partitioned"),
        (vtk(&mesh, 4, false), "UNSTRUCTURED_GRID", "POLYDATA", "expected UNSTRUCTURED_GRID"),
        (vtk(&mesh, 4, false), "Version 4.0", "Version 6.0", "the VTK version is \"6.0\""),
        (vtk(&mesh, 4, false), "gmsh:physical", "physical", "\"group\" or \"gmsh:physical\""),
        (vtk(&mesh, 4, false), "\n3 5 5", "\n3 22 5", "triangle of second or higher order"),
        (vtk(&mesh, 4, false), "CELLS 13", "CELLS 12", "array CELLS has 13 values; expected 12"),
        (ascii(Style::Ascii), "LittleEndian", "BigEndian", "expected LittleEndian"),
        (
            ascii(Style::Ascii),
            "UnstructuredGrid\" version",
            "PolyData\" version",
            "expected UnstructuredGrid",
        ),
        (ascii(Style::InlineZlib), "vtkZLibDataCompressor", "vtkLZ4DataCompressor", "vtkLZ4DataCompressor"),
        (ascii(Style::Ascii), "Name=\"group\"", "Name=\"colour\"", "\"group\" or \"gmsh:physical\""),
        (ascii(Style::Ascii), "</Cells>", "</Cell>", "not well-formed XML"),
        (
            ascii(Style::Inline),
            "Name=\"group\" NumberOfComponents=\"1\" format=\"binary\">\n",
            "Name=\"group\" NumberOfComponents=\"1\" format=\"binary\">\n!",
            "not base64",
        ),
        (
            ascii(Style::Ascii),
            "Name=\"types\" NumberOfComponents=\"1\" format=\"ascii\"",
            "Name=\"types\" format=\"ebcdic\"",
            "expected the format ascii, binary or appended",
        ),
    ] {
        let message = refused(bytes, from, to);
        assert!(message.contains(words), "{words:?} is not in {message:?}");
    }
    assert!(matches!(parse_mesh(b""), Err(MeshFileError::UnknownFormat { .. })));
    assert!(matches!(parse_mesh(b"solid beam"), Err(MeshFileError::UnknownFormat { .. })));
    let mut big = msh4(&mesh, true);
    let one = big.windows(4).position(|w| w == [1, 0, 0, 0]).expect("the number 1");
    big[one..one + 4].copy_from_slice(&[0, 0, 0, 1]);
    let message = parse_mesh(&big).expect_err("another byte order").to_string();
    assert!(message.contains("big endian"), "{message}");
}

/// Numbers that announce more than the file holds must not be believed.
#[test]
fn absurd_counts_do_not_allocate() {
    let mesh = cube();
    let nodes = mesh_writers::contents(&mesh).nodes.len();
    let huge = "4611686018427387904";
    for (bytes, from) in [
        (msh2(&mesh, false), format!("$Nodes\n{nodes}")),
        (msh4(&mesh, false), "$Nodes\n2 ".to_owned()),
        (msh4(&mesh, false), "$PhysicalNames\n4".to_owned()),
        (vtk(&mesh, 4, false), format!("POINTS {nodes}")),
        (vtk(&mesh, 5, false), "CELLS 14".to_owned()),
    ] {
        let number = from.trim_end().rsplit([' ', '\n']).next().expect("a number").to_owned();
        let to = from.replace(&number, huge);
        assert!(refused(bytes, &from, &to).contains("expected"), "{from}");
    }
}

#[test]
fn a_written_mesh_reads_back_equal() {
    let mesh = fixture::slab();
    let mut bytes = Vec::new();
    write_msh(&mesh, &mut bytes).expect("memory");
    assert_eq!(parse_mesh(&bytes).expect("sound"), mesh);
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(4),
        ..ProptestConfig::with_cases(400)
    })]

    /// A file cut anywhere before its last section is refused; nowhere does it crash a parser.
    #[test]
    fn no_parser_panics_on_a_truncated_file(which in 0_usize..16, share in 0.0..1.0_f64) {
        let (name, bytes) = &files()[which];
        let cut = (share * bytes.len() as f64) as usize;
        let parsed = parse_mesh(&bytes[..cut]);
        prop_assert!(parsed.is_err() || cut + 40 > bytes.len(), "{name} cut at {cut} of {}", bytes.len());
    }

    #[test]
    fn no_parser_panics_on_flipped_bits(
        which in 0_usize..16,
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..8), 1..6),
    ) {
        let mut bytes = files()[which].1.clone();
        for (at, bit) in flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        // Whether it is refused depends on where the flips fell; that it returns is what is asked.
        let _ = parse_mesh(&bytes);
    }

    /// Damage that keeps the text well formed: a word replaced by another of the same file.
    #[test]
    fn no_parser_panics_on_exchanged_words(which in 0_usize..16, from in any::<prop::sample::Index>(), to in any::<prop::sample::Index>()) {
        let (_, bytes) = &files()[which];
        let words: Vec<&[u8]> = bytes.split(|b| b.is_ascii_whitespace()).collect();
        let mut exchanged = words.clone();
        exchanged[to.index(words.len())] = words[from.index(words.len())];
        let _ = parse_mesh(&exchanged.join(&b' '));
        let _ = parse_mesh(&exchanged.join(&b'\n'));
    }
}

//! Mesh files of every format, written from scratch by the letter of each specification: the other side of
//! the parsers under test.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use phantom_rig::mesh::{Block, TetMesh, block};
use std::fmt::Write as _;
use std::io::Write as _;

/// A block of six tetrahedra with three named surfaces of two triangles each.
pub(crate) fn cube() -> TetMesh {
    let mut mesh = block(&Block { size_m: [0.06, 0.04, 0.02], cells: [1, 1, 1] }).expect("a block");
    mesh.surfaces = [("fixed", "z-"), ("search", "x-"), ("observed", "z+")]
        .map(|(name, side)| (name.to_owned(), mesh.surface(side).to_vec()))
        .into();
    mesh
}

/// Nodes, cells (VTK type, nodes, group) and names as the files hold them: with a node of nothing in front, a
/// line, and every second triangle turned inward.
pub(crate) struct Contents {
    pub(crate) nodes: Vec<[f64; 3]>,
    pub(crate) cells: Vec<(u8, Vec<u32>, i32)>,
    pub(crate) names: Vec<(String, i32, i32)>,
}

pub(crate) fn contents(mesh: &TetMesh) -> Contents {
    let mut nodes = vec![[9.0, 9.0, 9.0]];
    nodes.extend(mesh.nodes.iter().map(|p| <[f64; 3]>::from(*p)));
    let mut cells = vec![(3, vec![1, 2], 0)];
    let mut names = vec![("phantom".to_owned(), 1, 3)];
    for (i, (name, faces)) in mesh.surfaces.iter().enumerate() {
        let group = 10 + i as i32;
        names.push((name.clone(), group, 2));
        for (k, &[a, b, c]) in faces.iter().enumerate() {
            let face = if k % 2 == 1 { [a, c, b] } else { [a, b, c] };
            cells.push((5, face.map(|n| n + 1).to_vec(), group));
        }
    }
    cells.extend(mesh.tets.iter().map(|t| (10, t.map(|n| n + 1).to_vec(), 1)));
    Contents { nodes, cells, names }
}

/// Number of a node in a Gmsh file: neither consecutive nor from 1.
fn tag(node: u32) -> i32 {
    100 - 3 * node as i32
}

fn gmsh_type(vtk_type: u8) -> i32 {
    match vtk_type {
        3 => 1,
        5 => 2,
        10 => 4,
        other => panic!("no Gmsh type for {other}"),
    }
}

fn physical_names(c: &Contents) -> String {
    let mut text = format!("$PhysicalNames\n{}\n", c.names.len());
    for (name, number, dimension) in &c.names {
        writeln!(text, "{dimension} {number} \"{name}\"").expect("a string");
    }
    text + "$EndPhysicalNames\n"
}

pub(crate) fn msh2(mesh: &TetMesh, binary: bool) -> Vec<u8> {
    let c = contents(mesh);
    let mut out = Vec::new();
    if binary {
        out.extend(b"$MeshFormat\n2.2 1 8\n");
        out.extend(1_i32.to_le_bytes());
        out.extend(b"\n$EndMeshFormat\n");
    } else {
        out.extend(b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Comment\nnot read\n$EndComment\n");
    }
    out.extend(physical_names(&c).bytes());
    out.extend(format!("$Nodes\n{}\n", c.nodes.len()).bytes());
    for (i, p) in c.nodes.iter().enumerate() {
        if binary {
            out.extend(tag(i as u32).to_le_bytes());
            p.iter().for_each(|x| out.extend(x.to_le_bytes()));
        } else {
            out.extend(format!("{} {:?} {:?} {:?}\n", tag(i as u32), p[0], p[1], p[2]).bytes());
        }
    }
    out.extend(format!("\n$EndNodes\n$Elements\n{}\n", c.cells.len()).bytes());
    for (i, (kind, nodes, group)) in c.cells.iter().enumerate() {
        let mut numbers = vec![gmsh_type(*kind)];
        if binary {
            numbers.extend([1, 2, i as i32 + 1]);
        } else {
            numbers = vec![i as i32 + 1, gmsh_type(*kind), 2];
        }
        numbers.extend([*group, 7]);
        numbers.extend(nodes.iter().map(|&n| tag(n)));
        if binary {
            numbers.iter().for_each(|n| out.extend(n.to_le_bytes()));
        } else {
            let words: Vec<String> = numbers.iter().map(ToString::to_string).collect();
            out.extend((words.join(" ") + "\n").bytes());
        }
    }
    out.extend(b"\n$EndElements\n");
    out
}

/// Numbers of an MSH 4.1 file, in words or bytes.
struct Sink(Vec<u8>, bool);

impl Sink {
    fn ints(&mut self, values: &[i32]) {
        for v in values {
            if self.1 { self.0.extend(v.to_le_bytes()) } else { self.0.extend(format!("{v} ").bytes()) }
        }
    }
    fn sizes(&mut self, values: &[usize]) {
        for &v in values {
            let v = v as u64;
            if self.1 { self.0.extend(v.to_le_bytes()) } else { self.0.extend(format!("{v} ").bytes()) }
        }
    }
    fn doubles(&mut self, values: &[f64]) {
        for v in values {
            if self.1 { self.0.extend(v.to_le_bytes()) } else { self.0.extend(format!("{v:?}\n").bytes()) }
        }
    }
    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes());
    }
}

pub(crate) fn msh4(mesh: &TetMesh, binary: bool) -> Vec<u8> {
    let c = contents(mesh);
    let mut out = Sink(Vec::new(), binary);
    out.text(if binary { "$MeshFormat\n4.1 1 8\n" } else { "$MeshFormat\n4.1 0 8\n" });
    if binary {
        out.ints(&[1]);
        out.text("\n");
    }
    out.text("$EndMeshFormat\n");
    out.text(&physical_names(&c));
    out.text("$Entities\n");
    out.sizes(&[1, 1, 3, 1]);
    out.ints(&[5]);
    out.doubles(&[0.0; 3]);
    out.sizes(&[0]);
    out.ints(&[6]);
    out.doubles(&[0.0; 6]);
    out.sizes(&[0, 2]);
    out.ints(&[5, -5]);
    for surface in 0..3 {
        out.ints(&[20 + surface]);
        out.doubles(&[0.0; 6]);
        out.sizes(&[1]);
        out.ints(&[10 + surface]);
        out.sizes(&[1]);
        out.ints(&[6]);
    }
    out.ints(&[30]);
    out.doubles(&[0.0; 6]);
    out.sizes(&[1]);
    out.ints(&[1]);
    out.sizes(&[3]);
    out.ints(&[20, 21, 22]);
    out.text("\n$EndEntities\n$Nodes\n");
    // Two blocks, the second with one parameter a node, as curves have.
    out.sizes(&[2, c.nodes.len(), 1, 100]);
    let (first, second) = c.nodes.split_at(4);
    for (dimension, parametric, start, nodes) in [(3, 0, 0, first), (1, 1, 4, second)] {
        out.ints(&[dimension, 30, parametric]);
        out.sizes(&[nodes.len()]);
        let tags: Vec<usize> = (0..nodes.len()).map(|i| tag((start + i) as u32) as usize).collect();
        out.sizes(&tags);
        for p in nodes {
            out.doubles(p);
            if parametric == 1 {
                out.doubles(&[0.5]);
            }
        }
    }
    out.text("\n$EndNodes\n$Elements\n");
    out.sizes(&[c.cells.len(), c.cells.len(), 1, c.cells.len()]);
    for (i, (kind, nodes, group)) in c.cells.iter().enumerate() {
        let (dimension, entity) = match group {
            0 => (1, 6),
            1 => (3, 30),
            surface => (2, surface + 10),
        };
        out.ints(&[dimension, entity, gmsh_type(*kind)]);
        out.sizes(&[1, i + 1]);
        let tags: Vec<usize> = nodes.iter().map(|&n| tag(n) as usize).collect();
        out.sizes(&tags);
    }
    out.text("\n$EndElements\n");
    out.0
}

pub(crate) fn vtk(mesh: &TetMesh, major: u32, binary: bool) -> Vec<u8> {
    let c = contents(mesh);
    let mut out = Vec::new();
    let kind = if binary { "BINARY" } else { "ASCII" };
    out.extend(
        format!("# vtk DataFile Version {major}.0\na block\n{kind}\nDATASET UNSTRUCTURED_GRID\n").bytes(),
    );
    let ints = |out: &mut Vec<u8>, values: &[i32]| {
        for v in values {
            if binary { out.extend(v.to_be_bytes()) } else { out.extend(format!("{v} ").bytes()) }
        }
        out.push(b'\n');
    };
    let longs = |out: &mut Vec<u8>, values: &[i64]| {
        for v in values {
            if binary { out.extend(v.to_be_bytes()) } else { out.extend(format!("{v} ").bytes()) }
        }
        out.push(b'\n');
    };
    out.extend(format!("FIELD FieldData {}\n", c.names.len()).bytes());
    for (name, number, dimension) in &c.names {
        out.extend(format!("{name} 2 1 int\n").bytes());
        ints(&mut out, &[*number, *dimension]);
        out.extend(b"METADATA\nINFORMATION 0\n\n");
    }
    out.extend(format!("POINTS {} double\n", c.nodes.len()).bytes());
    for x in c.nodes.iter().flatten() {
        if binary { out.extend(x.to_be_bytes()) } else { out.extend(format!("{x:?} ").bytes()) }
    }
    out.push(b'\n');
    let connectivity: Vec<i64> = c.cells.iter().flat_map(|(_, n, _)| n.iter().map(|&n| n.into())).collect();
    if major >= 5 {
        out.extend(
            format!("CELLS {} {}\nOFFSETS vtktypeint64\n", c.cells.len() + 1, connectivity.len()).bytes(),
        );
        let mut offsets = vec![0];
        offsets.extend(ends(&c));
        longs(&mut out, &offsets);
        out.extend(b"CONNECTIVITY vtktypeint64\n");
        longs(&mut out, &connectivity);
    } else {
        out.extend(format!("CELLS {} {}\n", c.cells.len(), c.cells.len() + connectivity.len()).bytes());
        let list: Vec<i32> = c
            .cells
            .iter()
            .flat_map(|(_, n, _)| std::iter::once(n.len() as i32).chain(n.iter().map(|&n| n as i32)))
            .collect();
        ints(&mut out, &list);
    }
    out.extend(format!("CELL_TYPES {}\n", c.cells.len()).bytes());
    ints(&mut out, &c.cells.iter().map(|(k, _, _)| i32::from(*k)).collect::<Vec<_>>());
    let groups: Vec<i32> = c.cells.iter().map(|(_, _, g)| *g).collect();
    out.extend(format!("POINT_DATA {}\nVECTORS some%20thing int\n", c.nodes.len()).bytes());
    ints(&mut out, &vec![4; 3 * c.nodes.len()]);
    out.extend(format!("CELL_DATA {}\n", c.cells.len()).bytes());
    if major >= 4 {
        out.extend(format!("FIELD FieldData 1\ngmsh:physical 1 {} int\n", c.cells.len()).bytes());
    } else {
        out.extend(b"SCALARS group int 1\nLOOKUP_TABLE default\n");
    }
    ints(&mut out, &groups);
    out
}

fn ends(c: &Contents) -> Vec<i64> {
    let mut end = 0;
    c.cells
        .iter()
        .map(|(_, n, _)| {
            end += n.len() as i64;
            end
        })
        .collect()
}

/// How a VTU file writes its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Style {
    Ascii,
    /// Inline base64, header and data in one piece.
    Inline,
    /// Inline base64 of zlib blocks of 64 bytes, the header in a piece of its own.
    InlineZlib,
    AppendedRaw,
    AppendedRawZlib,
    AppendedBase64,
}

pub(crate) const STYLES: [Style; 6] = [
    Style::Ascii,
    Style::Inline,
    Style::InlineZlib,
    Style::AppendedRaw,
    Style::AppendedRawZlib,
    Style::AppendedBase64,
];

pub(crate) fn vtu(mesh: &TetMesh, style: Style) -> Vec<u8> {
    let c = contents(mesh);
    let mut appended: Vec<u8> = Vec::new();
    let mut array = |name: &str, components: usize, kind: &str, text: String, bytes: Vec<u8>| {
        let (format, body) = match style {
            Style::Ascii => ("format=\"ascii\"".to_owned(), text),
            Style::Inline | Style::InlineZlib => ("format=\"binary\"".to_owned(), encoded(style, &bytes)),
            _ => {
                let place = format!("format=\"appended\" offset=\"{}\"", appended.len());
                if style == Style::AppendedBase64 {
                    appended.extend(encoded(style, &bytes).bytes());
                } else {
                    appended.extend(packed(style, &bytes).concat());
                }
                (place, String::new())
            }
        };
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" {format}>\n{body}\n</DataArray>\n"
        )
    };
    let words = |v: &[i64]| v.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let mut longs = |name: &str, values: &[i64]| {
        array(name, 1, "Int64", words(values), values.iter().flat_map(|v| v.to_le_bytes()).collect())
    };
    let mut fields = String::new();
    for (name, number, dimension) in &c.names {
        fields += &longs(name, &[i64::from(*number), i64::from(*dimension)]);
    }
    let groups = longs("group", &c.cells.iter().map(|(_, _, g)| i64::from(*g)).collect::<Vec<_>>());
    let connectivity: Vec<i64> = c.cells.iter().flat_map(|(_, n, _)| n.iter().map(|&n| n.into())).collect();
    let mut cells = longs("connectivity", &connectivity);
    cells += &longs("offsets", &ends(&c));
    let types: Vec<u8> = c.cells.iter().map(|(k, _, _)| *k).collect();
    let text = words(&types.iter().map(|&t| i64::from(t)).collect::<Vec<_>>());
    cells += &array("types", 1, "UInt8", text, types);
    let flat: Vec<f64> = c.nodes.iter().flatten().copied().collect();
    let text = flat.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ");
    let points = array("Points", 3, "Float64", text, flat.iter().flat_map(|x| x.to_le_bytes()).collect());
    let compressor = match style {
        Style::InlineZlib | Style::AppendedRawZlib => " compressor=\"vtkZLibDataCompressor\"",
        _ => "",
    };
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"{compressor}>\n<UnstructuredGrid>\n<FieldData>\n{fields}</FieldData>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<PointData/>\n<CellData>\n{groups}</CellData>\n<Points>\n{points}</Points>\n<Cells>\n{cells}</Cells>\n</Piece>\n</UnstructuredGrid>\n",
        c.nodes.len(),
        c.cells.len()
    )
    .into_bytes();
    if !appended.is_empty() {
        let encoding = if style == Style::AppendedBase64 { "base64" } else { "raw" };
        out.extend(format!("<AppendedData encoding=\"{encoding}\">\n_").bytes());
        out.extend(appended);
        out.extend(b"\n</AppendedData>\n");
    }
    out.extend(b"</VTKFile>\n");
    out
}

/// Header and data of an array.
fn packed(style: Style, bytes: &[u8]) -> [Vec<u8>; 2] {
    const BLOCK: usize = 64;
    if !matches!(style, Style::InlineZlib | Style::AppendedRawZlib) {
        return [(bytes.len() as u64).to_le_bytes().to_vec(), bytes.to_vec()];
    }
    let blocks: Vec<Vec<u8>> = bytes
        .chunks(BLOCK)
        .map(|chunk| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(chunk).expect("memory");
            encoder.finish().expect("memory")
        })
        .collect();
    let mut header = vec![blocks.len() as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    header.extend(blocks.iter().map(|b| b.len() as u64));
    [header.iter().flat_map(|h| h.to_le_bytes()).collect(), blocks.concat()]
}

fn encoded(style: Style, bytes: &[u8]) -> String {
    let [header, data] = packed(style, bytes);
    if style == Style::InlineZlib {
        STANDARD.encode(header) + &STANDARD.encode(data)
    } else {
        STANDARD.encode([header, data].concat())
    }
}

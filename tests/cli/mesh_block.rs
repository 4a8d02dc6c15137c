//! `mesh block`: what it writes is a mesh that a bundle can use; what it refuses or abandons leaves nothing.

use super::{fixture, interrupt, names, phantom_rig, run, utf8};
use phantom_rig::dataset::{read_bundle, read_mesh, write_bundle};
use std::path::Path;
use std::process::Stdio;

const SLAB: [&str; 12] = [
    "mesh",
    "block",
    "--size-mm",
    "60x40x20",
    "--cells",
    "4x2x2",
    "--fixed",
    "z-,x<30mm",
    "--search",
    "z-,x>30mm",
    "--observed",
    "z+",
];

fn slab<'a>(file: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    SLAB.iter().copied().chain(more.iter().copied()).chain([file]).collect()
}

#[test]
fn a_written_block_serves_a_bundle() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write_bundle(&fixture::recording(), folder.path()).expect("writable");
    let file = folder.path().join("mesh.msh");
    std::fs::remove_file(&file).expect("there");
    let before = names(folder.path()).len();
    let (code, stdout, stderr) = run(&slab(utf8(&file), &[]));
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.contains("45 nodes, 96 tetrahedra"), "{stdout}");
    assert_eq!(names(folder.path()).len(), before + 1, "only the mesh is new");
    assert_eq!(read_bundle(folder.path()).expect("sound").0, fixture::recording());
}

#[test]
fn regions_add_up() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("beam.msh");
    let arguments = "mesh block --size-mm 100x30x30 --cells 10x3x3 --fixed x- --observed z+ --observed x+";
    let mut arguments: Vec<&str> = arguments.split(' ').collect();
    arguments.push(utf8(&file));
    let (code, stdout, _) = run(&arguments);
    assert_eq!(code, 0);
    assert!(stdout.contains("a bundle's mesh also needs search"), "{stdout}");
    let mesh = read_mesh(&file).expect("readable");
    let area = |name: &str| -> f64 { mesh.surface(name).iter().map(|&f| mesh.triangle(f).area()).sum() };
    assert!((area("observed") - (0.003 + 0.0009)).abs() < 1e-12);
    assert!((area("fixed") - 0.0009).abs() < 1e-12);
}

#[test]
fn a_file_that_exists_is_kept_unless_forced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("slab.msh");
    std::fs::write(&file, "precious").expect("writable");
    let (code, _, stderr) = run(&slab(utf8(&file), &[]));
    assert_eq!(code, 1);
    assert!(stderr.contains("slab.msh exists") && stderr.contains("--force"), "{stderr}");
    assert_eq!(std::fs::read_to_string(&file).expect("there"), "precious");
    assert_eq!(run(&slab(utf8(&file), &["--force"])).0, 0);
    assert!(read_mesh(&file).is_ok());
    assert_eq!(names(folder.path()), ["slab.msh"]);
    // A folder is no file, whatever is passed.
    for more in [&["--force"][..], &[]] {
        let (code, _, stderr) = run(&slab(utf8(folder.path()), more));
        assert!(code == 1 && stderr.contains("is a folder; expected the name of a file"), "{stderr}");
        assert!(!stderr.contains("pass --force"), "{stderr}");
    }
}

#[test]
fn senseless_blocks_are_usage_errors_and_leave_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("slab.msh");
    for (more, words) in [
        (&["--search", "z-,x>15mm"][..], "--search and --fixed overlap"),
        (&["--observed", "z+,x<30mm,y<7mm"], "cuts through cells, which are 20 mm long"),
        (&["--observed", "z+,x<0mm"], "no part of the block"),
        (&["--observed", "up"], "expected x-, x+, y-, y+, z- or z+"),
        (&["--observed", "z+,x<20"], "expected a number and mm, cm or m"),
    ] {
        let (code, stdout, stderr) = run(&slab(utf8(&file), more));
        assert_eq!((code, stdout.as_str()), (2, ""), "{words}");
        assert!(stderr.contains(words), "{words:?} is not in {stderr}");
    }
    for (size, cells) in [
        ("60x40", "1x1x1"),
        ("60x40x-1", "1x1x1"),
        ("60x40x20", "1x0x1"),
        ("1x1x1", "5000x5000x5000"),
        ("150x100x25", "3000x2000x500"),
    ] {
        let (code, _, _) = run(&["mesh", "block", "--size-mm", size, "--cells", cells, utf8(&file)]);
        assert_eq!(code, 2, "{size} {cells}");
    }
    assert_eq!(names(folder.path()), [""; 0]);
    let (code, _, stderr) = run(&slab("/no/such/folder/slab.msh", &[]));
    assert_eq!(code, 1);
    assert!(stderr.contains("/no/such/folder"), "{stderr}");
}

/// A block of a million tetrahedra takes long enough to be interrupted while it is staged.
#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("large.msh");
    let mut child = phantom_rig()
        .args(["mesh", "block", "--size-mm", "150x100x25", "--cells", "60x60x60", utf8(&file)])
        .stdout(Stdio::null())
        .spawn()
        .expect("the program starts");
    while names(folder.path()).is_empty() {
        assert!(child.try_wait().expect("a child").is_none(), "it ended before it had begun to write");
    }
    let staged = names(folder.path());
    assert!(staged[0].starts_with(".large.msh.partial-"), "{staged:?}");
    interrupt(child.id());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert_eq!(names(folder.path()), [""; 0]);
    assert!(!Path::new(&file).exists());
}

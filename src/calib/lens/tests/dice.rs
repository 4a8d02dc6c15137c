//! Pictures that others took of a target of dots, with the camera that they found: DICe's, whose target marks its axes by hollow dots.
//!
//! The pictures stay where they are: `PHANTOM_RIG_DATA`, or `../shared` beside the project. Without them nothing is tested.

use super::super::{Board, BoardKind, BoardView, board_in, calibrate_lens};
use super::scene::digits;
use crate::track::{Channels, GreyView, grey_from_colour};
use std::path::{Path, PathBuf};

/// The target, from `sim_white_dot_input.xml`; the radius is measured in the pictures.
const TARGET: Board =
    Board { kind: BoardKind::Dots { radius_m: 0.95e-3 }, columns: 14, rows: 10, pitch_m: 7e-3 };

fn pictures(begins: &str, ends: &str) -> Vec<PathBuf> {
    let root = std::env::var_os("PHANTOM_RIG_DATA").map(PathBuf::from).or_else(|| {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().skip(1);
        above.map(|a| a.join("shared")).find(|p| p.is_dir())
    });
    let Some(folder) = root.map(|r| r.join("data/dots/dice")).filter(|p| p.is_dir()) else {
        println!("skipped: no data");
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).expect("a readable folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let named = |p: &PathBuf| {
        let name = p.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        name.starts_with(begins) && name.ends_with(ends)
    };
    let mut paths: Vec<PathBuf> = paths.filter(named).collect();
    paths.sort();
    paths
}

fn view(path: &Path) -> BoardView {
    let colour = image::open(path).expect("a picture").to_rgb8();
    let (width, height) = (colour.width() as usize, colour.height() as usize);
    let grey = grey_from_colour(width, height, 3 * width, colour.as_raw(), Channels::Rgb).expect("grey");
    let view = GreyView::new(width, height, width, &grey).expect("a view");
    let seen = board_in(&view, &TARGET);
    println!("{}: {:?}", path.display(), seen.as_ref().map(|v| v.points.len()));
    seen.expect("most of the target")
}

/// Their camera came out of a calibration too, so that the two agree within what both are known to. A focal length of 6,700 px sees 16°:
/// it is known to a few thousandths from few pictures.
#[test]
fn the_camera_of_a_published_target_comes_out_again() {
    for (begins, ends, gold) in
        [("white_dot_", ".jpeg", [6671.8, 6667.8]), ("dot_", "_0.jpeg", [6673.3, 6669.3])]
    {
        let views: Vec<BoardView> = pictures(begins, ends).iter().map(|path| view(path)).collect();
        if views.is_empty() {
            continue;
        }
        let found = calibrate_lens(&views, &TARGET, [1920, 1200]).expect("a camera");
        println!(
            "{begins}: focal {:.1?}, principal {:.1?} px, deviations {}; residuals {:.4} px, χ²/dof {:.2}, lens known to {:.3} px",
            found.camera.focal_px,
            found.camera.principal_px,
            digits(found.deviations()),
            found.rms_px,
            found.chi2_per_dof,
            found.lens_sd_px
        );
        found.findings().iter().for_each(|finding| println!("  {finding}"));
        for ((focal, sd), gold) in found.camera.focal_px.iter().zip(found.deviations()).zip(gold) {
            assert!((focal - gold).abs() < 4.0 * sd + 1e-3 * gold, "{focal} {gold}");
        }
        assert!(found.rms_px < 0.05 && found.strangers().is_empty());
    }
}

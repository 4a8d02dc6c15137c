//! `calibrate camera`: what the camera's lens does, from pictures of a flat board.

use super::board_pictures::{BoardPicture, board_pictures};
use super::instrument::next_in_rig;
use crate::calib::lens::{
    Board, BoardKind, Distortion, Finding, LeftOut, LensError, LensFile, LensFound, calibrate_lens_with,
};
use crate::cli::{Context, Exit, Outcome, StagedFile, UsageError};
use crate::report::{Mark, MarkedDot, MarkedPicture, strip};
use crate::session::utc_text;
use crate::units::counted;
use anyhow::Context as _;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;
use std::time::SystemTime;

/// Finds out what the camera's lens does: focal length, principal point and distortion, from pictures of a flat board.
///
/// Take ten or more pictures of a board of dots or squares that is glued to something flat: the board whole or nearly so in each of them, sharp, tilted
/// by 20 to 40 degrees, each time in another direction, together reaching into all corners of the picture. Then tell how many points
/// it has in a row and in a column, and how far apart they are (measure the print: a wrong distance cannot be seen in pictures).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig calibrate camera board/*.png --board dots --columns 11 --rows 9 --pitch-mm 8 --radius-mm 2 --out rigs/lens.toml
  phantom-rig calibrate camera sessions/board --board checkerboard --columns 9 --rows 6 --pitch-mm 10 --out rigs/lens.toml")]
pub(in crate::cli) struct CameraArguments {
    /// Pictures (PNG, JPEG), folders of pictures, or sessions in which the board was held before the camera
    #[arg(value_name = "PICTURES", required = true, num_args = 1..)]
    pictures: Vec<PathBuf>,
    /// What the board shows; the points of a checkerboard are its inner corners
    #[arg(long, value_enum)]
    board: BoardWord,
    /// Points in a row
    #[arg(long)]
    columns: usize,
    /// Points in a column
    #[arg(long)]
    rows: usize,
    /// From the middle of a dot to the next, or the side of a square (mm)
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pitch_mm: f64,
    /// Radius of a dot (mm)
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    radius_mm: Option<f64>,
    /// Find k3 too: for wide lenses, with points up to the corners
    #[arg(long)]
    k3: bool,
    /// The file to write, for `lens` in the rig file
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Write the pictures with rings around the points, red where one is not where it should be
    #[arg(long, value_name = "FILE")]
    overlay: Option<PathBuf>,
    /// What should be known of the lens: focus, aperture, which camera; kept in the file
    #[arg(long, value_name = "TEXT", default_value = "")]
    note: String,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BoardWord {
    Dots,
    Checkerboard,
}

/// Radius of a ring around a corner (px).
const CORNER_PX: f64 = 6.0;

pub(super) fn run(arguments: &CameraArguments, context: &Context) -> anyhow::Result<Outcome> {
    let board = board(arguments)?;
    let staged = StagedFile::new(&arguments.out, arguments.force)?;
    let overlay =
        arguments.overlay.as_ref().map(|file| StagedFile::new(file, arguments.force)).transpose()?;
    let pictures = board_pictures(&arguments.pictures, &board, context)?;
    let mut text = without_board(&pictures.without);
    let Some(first) = pictures.with.first() else {
        let other = match board.kind {
            BoardKind::Dots { .. } => "--board checkerboard, with the numbers of its inner corners",
            BoardKind::Checkerboard => "--board dots, with --radius-mm",
        };
        anyhow::bail!(
            "{text}no picture shows the board of {board}; does it show the other kind? Then {other}"
        );
    };
    let views: Vec<_> = pictures.with.iter().map(|picture| picture.view.clone()).collect();
    let distortion = if arguments.k3 { Distortion::WithK3 } else { Distortion::FourTerms };
    let found = calibrate_lens_with(&views, &board, first.size_px, distortion)
        .with_context(|| format!("{text}{} of {board}", counted(views.len(), "picture", "pictures")))?;
    let file = LensFile::new(&found, &board, utc_text(SystemTime::now()), arguments.note.clone());
    let out = arguments.out.display();
    std::fs::write(staged.path(), file.text()?).with_context(|| format!("{out}: can't be written"))?;
    if let Some(staged) = &overlay {
        let png = drawn(&pictures.with, &found, &board)?;
        std::fs::write(staged.path(), png).context("the picture strip can't be written")?;
    }
    for done in [Some(staged), overlay].into_iter().flatten() {
        done.finish()?;
    }
    text += &said(&found, &board);
    text += &found.left_out.as_ref().map_or_else(String::new, |left_out| without_points(&found, left_out));
    let remarks: Vec<String> =
        found.findings().iter().map(|finding| remark(finding, &pictures.with)).collect();
    for remark in &remarks {
        text += &format!("\nnote: {remark}");
    }
    text += &next_in_rig("camera", "lens", &arguments.out);
    let json = json!({
        "format": "phantom-lens-result/1",
        "file": arguments.out,
        "pictures": pictures.with.iter().zip(&found.pictures).map(|(picture, fit)| json!({
            "name": picture.name,
            "rms_px": fit.rms_px,
            "held_out_rms_px": fit.held_out_rms_px,
            "outliers": fit.outliers.len(),
        })).collect::<Vec<_>>(),
        "left_out": pictures.without.iter().map(|(name, why)| json!({"name": name, "why": why.to_string()})).collect::<Vec<_>>(),
        "focal_px": found.camera.focal_px,
        "principal_px": found.camera.principal_px,
        "radial": found.camera.radial,
        "tangential": found.camera.tangential,
        "deviations": found.deviations(),
        "rms_px": found.rms_px,
        "held_out_rms_px": found.held_out_rms_px,
        "chi2_per_dof": found.chi2_per_dof,
        "points_left_out": found.left_out.as_ref().map(|left_out| json!({
            "points": left_out.points,
            "moved_px": left_out.moved_px,
            "with_them": {
                "focal_px": left_out.with_them.focal_px,
                "principal_px": left_out.with_them.principal_px,
                "radial": left_out.with_them.radial,
                "tangential": left_out.with_them.tangential,
            },
        })),
        "remarks": remarks,
    });
    let exit = if remarks.is_empty() { Exit::Good } else { Exit::Degraded };
    Ok(Outcome { exit, text, json })
}

fn board(arguments: &CameraArguments) -> anyhow::Result<Board> {
    let kind = match (arguments.board, arguments.radius_mm) {
        (BoardWord::Dots, Some(radius_mm)) => BoardKind::Dots { radius_m: radius_mm * 1e-3 },
        (BoardWord::Checkerboard, None) => BoardKind::Checkerboard,
        (BoardWord::Dots, None) => {
            return Err(UsageError("--board dots needs --radius-mm, the radius of a dot".to_owned()).into());
        }
        (BoardWord::Checkerboard, Some(_)) => {
            return Err(UsageError("--radius-mm is for --board dots".to_owned()).into());
        }
    };
    let (columns, rows, pitch_m) = (arguments.columns, arguments.rows, arguments.pitch_mm * 1e-3);
    let board = Board { kind, columns, rows, pitch_m };
    board.check().map_err(|error| UsageError(in_options(arguments, &error)))?;
    Ok(board)
}

/// What is wrong with a board, by the option and in its unit.
fn in_options(arguments: &CameraArguments, error: &LensError) -> String {
    let LensError::Board { name, value, expected } = error else { return error.to_string() };
    match *name {
        "pitch_m" => format!("--pitch-mm {}: expected {expected}", arguments.pitch_mm),
        "radius_m" => format!(
            "--radius-mm {}: expected {expected}, --pitch-mm {}",
            arguments.radius_mm.unwrap_or(1e3 * value),
            arguments.pitch_mm
        ),
        _ => error.to_string(),
    }
}

/// Pictures that show no board, a line for each reason: those in which too few points were found share one.
fn without_board(pictures: &[(String, LensError)]) -> String {
    let (partial, others): (Vec<_>, Vec<_>) =
        pictures.iter().partition(|(_, why)| matches!(why, LensError::Partial { .. }));
    let count = |why: &LensError| if let LensError::Partial { found, .. } = why { *found } else { 0 };
    let most = partial.iter().max_by_key(|(_, why)| count(why));
    let mut text: String = others.iter().map(|(name, why)| format!("left out: {name}: {why}\n")).collect();
    match (&partial[..], most) {
        ([(name, why)], _) => text += &format!("left out: {name}: {why}\n"),
        ([(first, _), .., (last, _)], Some((_, why))) => {
            text += &format!("left out: {} pictures, {first} … {last}: at best {why}\n", partial.len());
        }
        _ => {}
    }
    text
}

/// The figures, a line each.
fn said(found: &LensFound, board: &Board) -> String {
    let camera = &found.camera;
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = found.deviations();
    let ([k_1, k_2, k_3], [p_1, p_2]) = (camera.radial, camera.tangential);
    let mut text = format!(
        "{} of {board}, {} × {} pixels\n\
         focal length {:.2} ± {fx:.2} and {:.2} ± {fy:.2} px; principal point ({:.2} ± {cx:.2}, {:.2} ± {cy:.2}) px\n\
         k1 {k_1:.5} ± {k1:.5}, k2 {k_2:.4} ± {k2:.4}, p1 {p_1:.6} ± {p1:.6}, p2 {p_2:.6} ± {p2:.6}",
        counted(found.pictures.len(), "picture", "pictures"),
        camera.size_px[0],
        camera.size_px[1],
        camera.focal_px[0],
        camera.focal_px[1],
        camera.principal_px[0],
        camera.principal_px[1],
    );
    if k3 > 0.0 {
        text += &format!(", k3 {k_3:.3} ± {k3:.3}");
    }
    text += &format!("\nleft between points and camera: {:.3} px (root mean square)", found.rms_px);
    if let Some(held_out) = found.held_out_rms_px {
        text += &format!(", {held_out:.3} px in pictures that the camera was not found from");
    }
    text += &format!(
        "\nsomewhere in the picture a ray is known to ± {:.3} px, elsewhere better",
        found.lens_sd_px
    );
    text
}

/// What it changed that points were left out.
fn without_points(found: &LensFound, left_out: &LeftOut) -> String {
    let (camera, before) = (&found.camera, &left_out.with_them);
    let [fx, fy] = [0, 1].map(|k| camera.focal_px[k] - before.focal_px[k]);
    let [cx, cy] = [0, 1].map(|k| camera.principal_px[k] - before.principal_px[k]);
    format!(
        "\nfound without {} not where they should be: that changed the focal lengths by {fx:+.2} and {fy:+.2} px, \
         the principal point by ({cx:+.2}, {cy:+.2}) px, and moved rays by up to {:.3} px",
        counted(left_out.points, "point that is", "points that are"),
        left_out.moved_px
    )
}

/// A finding, with the name of the picture that it is about.
fn remark(finding: &Finding, pictures: &[BoardPicture]) -> String {
    match finding {
        Finding::Stranger { picture, .. } | Finding::Outliers { picture, .. } => {
            format!("{finding} ({})", pictures[*picture].name)
        }
        _ => finding.to_string(),
    }
}

fn drawn(pictures: &[BoardPicture], found: &LensFound, board: &Board) -> anyhow::Result<Vec<u8>> {
    let drawn: Vec<_> = (pictures.iter().zip(&found.pictures))
        .map(|(picture, fit)| {
            let marks = picture.view.points.iter().enumerate().map(|(k, point)| MarkedDot {
                centre_px: point.pixel,
                radius_px: radius_px(fit.pose.apply(point.board_m).norm(), found, board),
                number: None,
                mark: if fit.outliers.contains(&k) { Mark::Lost } else { Mark::Certain },
            });
            MarkedPicture {
                size_px: picture.size_px,
                levels: &picture.levels,
                dots: marks.collect(),
                caption: String::new(),
            }
        })
        .collect();
    Ok(strip(&drawn, &[])?)
}

/// How large a point looks from so far.
fn radius_px(distance_m: f64, found: &LensFound, board: &Board) -> f64 {
    match board.kind {
        BoardKind::Dots { radius_m } => found.camera.focal_px[0] * radius_m / distance_m,
        BoardKind::Checkerboard => CORNER_PX,
    }
}

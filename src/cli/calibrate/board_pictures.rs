//! Pictures of a calibration board: picture files, folders of them, and what a camera saw in a session.

use crate::calib::lens::{Board, BoardView, LensError, board_in};
use crate::cli::Context;
use crate::cli::picture_files::in_folder;
use crate::session::{Picture, Session};
use crate::track::GreyView;
use anyhow::{Context as _, bail};
use std::path::{Path, PathBuf};

/// A picture with the board that it shows.
pub(super) struct BoardPicture {
    /// Its file, or its session with the number of its frame.
    pub(super) name: String,
    pub(super) size_px: [usize; 2],
    pub(super) levels: Vec<u8>,
    pub(super) view: BoardView,
}

/// Pictures with a board, and those that were given as such but show none.
#[derive(Default)]
pub(super) struct BoardPictures {
    pub(super) with: Vec<BoardPicture>,
    /// Which file, and why.
    pub(super) without: Vec<(String, LensError)>,
}

/// A board that has moved by less between two frames was at rest when they were taken (px).
const AT_REST_PX: f64 = 0.3;
/// A pose is another one where points moved by this share of the picture's width on average.
const ANOTHER: f64 = 0.03;

/// The board in each picture of `sources`. Of a session's frames those are taken in which the board is at rest, once for each of its poses.
///
/// # Errors
/// A source that is neither session nor picture nor folder of pictures, pictures of different sizes.
pub(super) fn board_pictures(
    sources: &[PathBuf],
    board: &Board,
    context: &Context,
) -> anyhow::Result<BoardPictures> {
    let mut pictures = BoardPictures::default();
    for source in sources {
        if Session::is_at(source) {
            pictures.with.extend(of_session(source, board, context)?);
            continue;
        }
        let files = if source.is_dir() { in_folder(source)? } else { vec![source.clone()] };
        let bar = context.progress.bar("looking for the board", files.len() as u64);
        for file in files {
            let name = file.display().to_string();
            let read = image::open(&file).with_context(|| name.clone())?.into_luma8();
            let size_px = [read.width() as usize, read.height() as usize];
            let levels = read.into_raw();
            match board_in(&GreyView::new(size_px[0], size_px[1], size_px[0], &levels)?, board) {
                Ok(view) => pictures.with.push(BoardPicture { name, size_px, levels, view }),
                Err(why) => pictures.without.push((name, why)),
            }
            bar.advance();
        }
    }
    if let [first, rest @ ..] = pictures.with.as_slice()
        && let Some(other) = rest.iter().find(|other| other.size_px != first.size_px)
    {
        let ([w, h], [width, height]) = (first.size_px, other.size_px);
        bail!("{} has {w} × {h} pixels, {} {width} × {height}: one camera, one size", first.name, other.name);
    }
    Ok(pictures)
}

/// Frames in which the board is at rest, one for each of its poses.
fn of_session(folder: &Path, board: &Board, context: &Context) -> anyhow::Result<Vec<BoardPicture>> {
    let session = Session::open(folder)?;
    let frames = session.info()?.topics.get(&crate::session::Topic::Grey).map_or(0, |e| e.messages);
    let bar = context.progress.bar("looking for the board", frames);
    let mut kept: Vec<BoardPicture> = Vec::new();
    let mut before: Option<BoardView> = None;
    for frame in session.frames() {
        bar.advance();
        let frame = frame?;
        let Some(grey) = frame.grey.as_ref().and_then(Picture::grey) else { continue };
        let [width, height] = grey.size_px;
        let view = board_in(&GreyView::new(width, height, width, &grey.values)?, board).ok();
        let at_rest = before.iter().zip(&view).any(|(a, b)| moved_px(a, b) < AT_REST_PX);
        before.clone_from(&view);
        let Some(view) = view.filter(|_| at_rest) else { continue };
        if kept.iter().all(|other| moved_px(&other.view, &view) > ANOTHER * width as f64) {
            let name = format!("{}, frame {}", folder.display(), frame.frame.number);
            kept.push(BoardPicture { name, size_px: grey.size_px, levels: grey.values, view });
        }
    }
    Ok(kept)
}

/// How far the points of a board that both pictures show moved on average (px); without end where there are none.
fn moved_px(from: &BoardView, to: &BoardView) -> f64 {
    let moved: Vec<f64> = from
        .points
        .iter()
        .filter_map(|a| {
            let b = to.points.iter().find(|b| b.board_m == a.board_m)?;
            Some((a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1]))
        })
        .collect();
    if moved.is_empty() { f64::INFINITY } else { moved.iter().sum::<f64>() / moved.len() as f64 }
}

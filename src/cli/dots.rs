//! `dots`: the dots in pictures that a person has, with what speaks against them.

use super::picture_files::{GreyPicture, grey_picture, in_folder};
use super::{Context, Exit, Kind, Outcome, StagedFolder, UsageError};
use crate::report::{Mark, MarkedDot, MarkedPicture, strip};
use crate::session::Session;
use crate::track::{Dot, DotSettings, Finder, Found, GreyView};
use crate::units::counted;
use anyhow::{Context as _, bail};
use clap::Args;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Finds white dots on dark in pictures of your own, with the detector of `track`: to choose exposure, distance and dots before a session.
///
/// How large the dots are it finds out by itself. --out writes dots.csv (a dot a row), a picture NAME-dots.png of each with the dots ringed
/// (red where a dot is cut by the border or flows together with another, green elsewhere), and dots.json. Pixels are counted
/// from the centre of the upper left one, which is (0, 0); x goes right, y goes down.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig dots trial/*.png
  phantom-rig dots trial --out trial-dots
  phantom-rig dots photo.jpg --radius-px 4,9 --out photo-dots

Exit code 3: a picture without dots, with fewer than can be followed (also of the sizes that `track` looks for) or mostly
saturated ones, or one that can't be read.")]
pub(super) struct DotsArguments {
    /// Pictures (PNG, JPEG; grey or colour, 8 or 16 bits) or folders of pictures
    #[arg(value_name = "PICTURES", required = true, num_args = 1..)]
    pictures: Vec<PathBuf>,
    /// Where tables and ringed pictures go; an earlier result there is replaced
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Smallest and largest radius of a dot (px), in place of finding out
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', num_args = 1, allow_hyphen_values = true)]
    radius_px: Vec<f64>,
    /// Replace whatever is there
    #[arg(long)]
    force: bool,
}

/// Fewer dots than that can't be followed: nothing tells them apart by their neighbours.
const LEAST_DOTS: usize = 6;
/// A picture whose pixels are white for this share is overexposed; level from which one is white.
const WHITE: (f64, u8) = (0.3, 250);
/// A picture that is no lighter than this level, but for one pixel in a thousand, is underexposed.
const DARK: u8 = 24;

const TABLE: &str =
    "picture,dot,x_px,y_px,radius_px,aspect,quality,sd_px,contrast,background,saturated,border,merged\n";

/// What one picture shows.
struct Shown {
    file: PathBuf,
    size_px: [usize; 2],
    bits: u32,
    found: Found,
    radius_px: [f64; 2],
    /// What should be done about it.
    faults: Vec<String>,
    /// What may be worth knowing.
    remarks: Vec<String>,
}

pub(super) fn run(arguments: &DotsArguments, context: &Context) -> anyhow::Result<Outcome> {
    let given = settings(&arguments.radius_px)?;
    let files = files(&arguments.pictures)?;
    let staged = (arguments.out.as_ref())
        .map(|out| StagedFolder::new(out, Kind::Dots, arguments.force))
        .transpose()?;
    let bar = context.progress.bar("looking for dots", files.len() as u64);
    let (mut finder, mut table, mut names) = (Finder::default(), TABLE.to_owned(), HashSet::new());
    let (mut text, mut pictures, mut unreadable) = (String::new(), Vec::new(), Vec::new());
    let mut exit = Exit::Good;
    for file in &files {
        let read = match grey_picture(file) {
            Ok(read) => read,
            Err(why) => {
                let _ = writeln!(text, "not read: {why:#}");
                unreadable.push(json!({"picture": file, "why": format!("{why:#}")}));
                bar.advance();
                continue;
            }
        };
        let shown = look(file, &read, given, &mut finder)?;
        let mut overlay = None;
        if let Some(staged) = &staged {
            let name = overlay_name(file, &mut names);
            let place = staged.path().join(&name);
            fs::write(&place, ringed(&read, &shown.found.dots)?)
                .with_context(|| format!("{}: can't be written", place.display()))?;
            overlay = Some(name);
        }
        rows(&mut table, file, &shown.found.dots);
        text += &said(&shown);
        if !shown.faults.is_empty() {
            exit = Exit::Degraded;
        }
        pictures.push(summary(&shown, overlay));
        bar.advance();
    }
    if pictures.is_empty() {
        bail!("no picture could be read\n{}", text.trim_end());
    }
    if !unreadable.is_empty() {
        exit = Exit::Degraded;
    }
    let json = json!({
        "format": "phantom-dots/1",
        "out": arguments.out,
        "pictures": pictures,
        "unreadable": unreadable,
    });
    if let (Some(staged), Some(out)) = (staged, &arguments.out) {
        for (name, content) in [("dots.csv", table), ("dots.json", format!("{json:#}\n"))] {
            fs::write(staged.path().join(name), content)
                .with_context(|| format!("{name}: can't be written"))?;
        }
        staged.finish()?;
        let _ = write!(text, "Look at the pictures in {}", out.display());
    }
    Ok(Outcome { exit, text: text.trim_end().to_owned(), json })
}

/// Dots between the radii that were typed; none where none were.
fn settings(radius_px: &[f64]) -> anyhow::Result<Option<DotSettings>> {
    let radius_px = match *radius_px {
        [] => return Ok(None),
        [least, most] => [least, most],
        _ => return Err(UsageError("--radius-px takes two radii: MIN,MAX".to_owned()).into()),
    };
    let settings = DotSettings { radius_px, ..DotSettings::default() };
    settings.check().map_err(|error| UsageError(format!("--radius-px: {error}")))?;
    Ok(Some(settings))
}

/// The picture files among what was typed, and those in its folders.
fn files(sources: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for source in sources {
        if Session::is_at(source) {
            bail!("{0} is a session: `phantom-rig track {0} --out DIR` follows its dots", source.display());
        }
        if source.is_dir() {
            files.extend(in_folder(source)?);
        } else {
            files.push(source.clone());
        }
    }
    Ok(files)
}

fn look(
    file: &Path,
    read: &GreyPicture,
    given: Option<DotSettings>,
    finder: &mut Finder,
) -> anyhow::Result<Shown> {
    let pixels = &read.pixels;
    let [width, height] = pixels.size_px;
    let view = GreyView::new(width, height, width, &pixels.values)?;
    let (found, radius_px) = match given {
        Some(settings) => (finder.find(&view, &settings), settings.radius_px),
        None => finder.find_of_any_size(&view, &DotSettings::default()),
    };
    let whole = found.dots.iter().filter(|d| d.is_whole()).count();
    let white = found.dots.iter().filter(|d| d.saturated).count();
    let mut faults = Vec::new();
    if whole < LEAST_DOTS {
        let [least, most] = radius_px;
        let some = if found.dots.is_empty() { "no dots".to_owned() } else { format!("{whole} whole dots") };
        faults.push(format!(
            "{some} of {least:.1} to {most:.1} px radius, white on dark; it takes {LEAST_DOTS} to tell dots apart"
        ));
        faults.extend(why_so_few(&pixels.values, whole, [width, height], finder)?);
    } else if 2 * white > found.dots.len() {
        faults.push(format!(
            "{white} of {} dots are saturated, white over a fifth of them or more: expose less",
            found.dots.len()
        ));
    }
    let mut remarks = Vec::new();
    let followed = finder.find(&view, &DotSettings::default()).dots.iter().filter(|d| d.is_whole()).count();
    if whole >= LEAST_DOTS && (followed as f64) < 0.98 * whole as f64 {
        let said = less_followed(&found.dots, followed);
        if followed < LEAST_DOTS { faults.push(said) } else { remarks.push(said) }
    }
    Ok(Shown {
        file: file.to_owned(),
        size_px: [width, height],
        bits: read.bits,
        found,
        radius_px,
        faults,
        remarks,
    })
}

/// That `track` would find fewer dots, and why: its limits hold for half of a dot's longest diameter, which of a tilted dot is more than the
/// radius of the same area.
fn less_followed(dots: &[Dot], followed: usize) -> String {
    let [least, most] = DotSettings::default().radius_px;
    let halves = || dots.iter().filter(|d| d.is_whole()).map(Dot::longest_px);
    let counts = [
        (halves().filter(|half| *half > most).count(), "too large"),
        (halves().filter(|half| *half < least).count(), "too small"),
    ];
    let mut said = format!(
        "`track` looks for {least} to {most} px radius, half of the longest diameter, and would find {followed} dots"
    );
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        let _ = write!(said, "; {count} are {what}");
    }
    if let Some(half) = median(dots, Dot::longest_px) {
        let _ = write!(said, "; here that half is {half:.1} px");
    }
    said
}

/// What a picture with next to no dots has instead.
fn why_so_few(
    levels: &[u8],
    whole: usize,
    [width, height]: [usize; 2],
    finder: &mut Finder,
) -> anyhow::Result<Option<String>> {
    let mut sorted = levels.to_vec();
    let nearly_last = sorted.len() - 1 - sorted.len() / 1000;
    let lightest = *sorted.select_nth_unstable(nearly_last).1;
    let white = levels.iter().filter(|&&level| level >= WHITE.1).count() as f64 / levels.len() as f64;
    if lightest < DARK {
        return Ok(Some(format!("hardly a pixel is lighter than {lightest} of 255: expose longer")));
    }
    if white > WHITE.0 {
        return Ok(Some(format!("{:.0} % of the picture is white: expose less", 1e2 * white)));
    }
    let inverse: Vec<u8> = levels.iter().map(|level| 255 - level).collect();
    let view = GreyView::new(width, height, width, &inverse)?;
    let dark = finder.find_of_any_size(&view, &DotSettings::default()).0.dots.len();
    Ok((dark >= LEAST_DOTS.max(2 * whole)).then(|| {
        format!("it has {dark} dark dots on light: the phantom needs light ones on dark (`calibrate camera` takes both)")
    }))
}

/// Centre, size and what speaks against each dot.
fn rows(table: &mut String, file: &Path, dots: &[Dot]) {
    // Names of files may have commas.
    let name = file.display().to_string().replace('"', "\"\"");
    for (number, dot) in dots.iter().enumerate() {
        let [x, y] = dot.centre_px;
        let _ = writeln!(
            table,
            "\"{name}\",{number},{x:.4},{y:.4},{:.3},{:.3},{:.4},{:.4},{:.1},{:.1},{},{},{}",
            dot.radius_px(),
            dot.aspect(),
            dot.quality,
            sd_px(dot),
            dot.contrast,
            dot.background,
            dot.saturated,
            dot.border,
            dot.merged
        );
    }
}

/// Standard deviation of a centre (px): root mean square of both axes.
fn sd_px(dot: &Dot) -> f64 {
    (0.5 * dot.covariance_px2.trace()).max(0.0).sqrt()
}

/// The middle one of what the dots say; none without dots.
fn median(dots: &[Dot], of: impl Fn(&Dot) -> f64) -> Option<f64> {
    let mut values: Vec<f64> = dots.iter().map(of).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The picture with a ring round every dot, as a PNG.
fn ringed(read: &GreyPicture, dots: &[Dot]) -> anyhow::Result<Vec<u8>> {
    let marks = dots.iter().map(|dot| MarkedDot {
        centre_px: dot.centre_px,
        radius_px: dot.radius_px(),
        number: None,
        mark: if dot.is_whole() { Mark::Certain } else { Mark::Lost },
    });
    let picture = MarkedPicture {
        size_px: read.pixels.size_px,
        levels: &read.pixels.values,
        dots: marks.collect(),
        caption: String::new(),
    };
    Ok(strip(&[picture], &[])?)
}

/// A name that no other picture of the folder has.
fn overlay_name(file: &Path, taken: &mut HashSet<String>) -> String {
    let stem = file.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy());
    let names =
        (1..).map(|n| if n == 1 { format!("{stem}-dots.png") } else { format!("{stem}-{n}-dots.png") });
    names.into_iter().find(|name| taken.insert(name.clone())).unwrap_or_default()
}

fn said(shown: &Shown) -> String {
    let dots = &shown.found.dots;
    let count = |of: fn(&Dot) -> bool| dots.iter().filter(|d| of(d)).count();
    let mut text = format!("{}: {}", shown.file.display(), counted(dots.len(), "dot", "dots"));
    if let (Some(radius), Some(contrast), Some(sd)) =
        (median(dots, Dot::radius_px), median(dots, |d| d.contrast), median(dots, sd_px))
    {
        let _ = write!(
            text,
            ", radius {radius:.1} px, {contrast:.0} of 255 above their surroundings (noise {:.1}), centres known to {sd:.3} px",
            shown.found.noise
        );
        let counts = [
            (count(|d| d.saturated), "saturated"),
            (count(|d| d.border), "cut by the border"),
            (count(|d| d.merged), "flowing together with something"),
        ];
        for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
            let _ = write!(text, "; {count} {what}");
        }
    }
    for fault in shown.faults.iter().chain(&shown.remarks) {
        let _ = write!(text, "\n  {fault}");
    }
    text + "\n"
}

fn summary(shown: &Shown, overlay: Option<String>) -> Value {
    let dots = &shown.found.dots;
    let count = |of: fn(&Dot) -> bool| dots.iter().filter(|d| of(d)).count();
    json!({
        "picture": shown.file,
        "size_px": shown.size_px,
        "bits": shown.bits,
        "dots": dots.len(),
        "whole": count(Dot::is_whole),
        "saturated": count(|d| d.saturated),
        "border": count(|d| d.border),
        "merged": count(|d| d.merged),
        "looked_for_radius_px": shown.radius_px,
        "radius_px": median(dots, Dot::radius_px),
        "contrast": median(dots, |d| d.contrast),
        "noise": shown.found.noise,
        "sd_px": median(dots, sd_px),
        "faults": shown.faults,
        "remarks": shown.remarks,
        "overlay": overlay,
    })
}

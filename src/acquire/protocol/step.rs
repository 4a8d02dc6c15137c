//! One `[[step]]` of a protocol file → what is to be done.

use super::grid;
use super::quantity::Allowed;
use super::refusal::{Refusal, nearest};
use super::section::Section;
use super::steps::{Kind, Place, Profile, Stroke, Target, Task, check_count, strokes};

/// Rest before a poke where the file says nothing (s).
const PAUSE_S: f64 = 1.0;

/// Keys of every motion.
const MOTION: [&str; 4] = ["direction", "speed_mm_s", "retreat_speed_mm_s", "pause_s"];
/// Keys of every poke.
const POKE: [&str; 5] = ["depth_mm", "until_force_n", "depth_limit_mm", "hold_s", "repeats"];

fn known(kind: Kind) -> Vec<&'static str> {
    let own: &[&'static str] = match kind {
        Kind::Poke => &["site_mm"],
        Kind::Grid => &grid::KEYS,
        Kind::Cycles => &["site_mm", "offset_mm", "amplitude_mm", "cycles"],
        Kind::Air => &["site_mm", "depth_mm", "hold_s", "repeats"],
        Kind::Wait => &["wait_s"],
        Kind::Mark | Kind::Ask => &["text"],
    };
    let mut keys = vec!["kind"];
    keys.extend(own);
    if matches!(kind, Kind::Poke | Kind::Grid) {
        keys.extend(POKE);
    }
    if matches!(kind, Kind::Poke | Kind::Grid | Kind::Cycles | Kind::Air) {
        keys.extend(MOTION);
    }
    keys
}

/// Refuses defaults that no step could take.
pub(super) fn check_defaults(defaults: &Section<'_, '_>) -> Result<(), Refusal> {
    let keys: Vec<&'static str> = MOTION.into_iter().chain(POKE).collect();
    defaults.only(&keys)?;
    motion(defaults)?;
    press(defaults)?;
    defaults.count("repeats").map(|_| ())
}

/// What kind a step is.
pub(super) fn kind(step: &Section<'_, '_>) -> Result<Kind, Refusal> {
    let names = Kind::ALL.map(Kind::name);
    let expected = || format!("one of {}", names.map(|n| format!("\"{n}\"")).join(", "));
    let value = step.find("kind").ok_or_else(|| step.missing("kind", expected()))?;
    let said = value.get_ref().as_str().unwrap_or_default();
    let found = Kind::ALL.into_iter().find(|kind| kind.name() == said);
    found.ok_or_else(|| {
        let meant = nearest(said, names.into_iter()).map(|n| format!("; did you mean \"{n}\"?"));
        step.wrong("kind", value, expected() + &meant.unwrap_or_default())
    })
}

/// What a step of this kind asks for.
pub(super) fn task(step: &Section<'_, '_>, kind: Kind) -> Result<Task, Refusal> {
    step.only(&known(kind))?;
    match kind {
        Kind::Poke | Kind::Air => {
            let places = vec![Place { number: 1, site_m: step.place("site_mm")? }];
            let stroke = Stroke { air: kind == Kind::Air, ..poke(step, kind)? };
            Ok(Task::Strokes { stroke, places, repeats: repeats(step)? })
        }
        Kind::Grid => {
            let (stroke, repeats) = (poke(step, kind)?, repeats(step)?);
            let grid = grid::read(step)?;
            // Before the places are made.
            check_count(strokes(grid.places(), repeats, 1)).map_err(|problem| step.refuse(problem))?;
            Ok(Task::Strokes { stroke, places: grid.visited(), repeats })
        }
        Kind::Cycles => {
            let places = vec![Place { number: 1, site_m: step.place("site_mm")? }];
            Ok(Task::Strokes { stroke: stroke(step, cycles(step)?)?, places, repeats: 1 })
        }
        Kind::Wait => Ok(Task::Wait { duration_s: step.need("wait_s", Allowed::TIME_S)? }),
        Kind::Mark => Ok(Task::Mark { text: step.need_text("text")?.to_owned() }),
        Kind::Ask => Ok(Task::Ask { text: step.need_text("text")?.to_owned() }),
    }
}

fn repeats(step: &Section<'_, '_>) -> Result<u32, Refusal> {
    Ok(step.count("repeats")?.unwrap_or(1))
}

fn poke(step: &Section<'_, '_>, kind: Kind) -> Result<Stroke, Refusal> {
    let profile = if kind == Kind::Air {
        // A default force does not stop what touches nothing.
        let target = Target::Depth { depth_m: step.need("depth_mm", Allowed::DEPTH_MM)? };
        Profile::Press { target, hold_s: hold_s(step)? }
    } else {
        let expected = "depth_mm, or until_force_n with depth_limit_mm";
        press(step)?.ok_or_else(|| step.missing("depth_mm", expected))?
    };
    stroke(step, profile)
}

fn stroke(step: &Section<'_, '_>, profile: Profile) -> Result<Stroke, Refusal> {
    let Motion { direction, speed_m_s, retreat_speed_m_s, pause_s } = motion(step)?;
    let speed_m_s = speed_m_s.map_or_else(|| step.need("speed_mm_s", Allowed::SPEED_MM_S), Ok)?;
    let retreat_speed_m_s = retreat_speed_m_s.unwrap_or(speed_m_s);
    let pause_s = pause_s.unwrap_or(PAUSE_S);
    Ok(Stroke { direction, profile, speed_m_s, retreat_speed_m_s, pause_s, air: false, radius_m: None })
}

/// What a table says of a motion.
struct Motion {
    direction: Option<[f64; 3]>,
    speed_m_s: Option<f64>,
    retreat_speed_m_s: Option<f64>,
    pause_s: Option<f64>,
}

fn motion(table: &Section<'_, '_>) -> Result<Motion, Refusal> {
    Ok(Motion {
        direction: table.unit_vector("direction")?,
        speed_m_s: table.number("speed_mm_s", Allowed::SPEED_MM_S)?,
        retreat_speed_m_s: table.number("retreat_speed_mm_s", Allowed::SPEED_MM_S)?,
        pause_s: table.number("pause_s", Allowed::TIME_S)?,
    })
}

fn hold_s(table: &Section<'_, '_>) -> Result<f64, Refusal> {
    Ok(table.number("hold_s", Allowed::TIME_S)?.unwrap_or(0.0))
}

/// In, hold, out; none where nothing says how far. What a step says itself goes before the defaults.
fn press(table: &Section<'_, '_>) -> Result<Option<Profile>, Refusal> {
    let hold_s = hold_s(table)?;
    let (depth, force, limit) = ("depth_mm", "until_force_n", "depth_limit_mm");
    if table.says(depth) && table.says(force) {
        return Err(table.exclusive(depth, force));
    }
    let by_depth = table.says(depth) || (table.find(depth).is_some() && !table.says(force));
    if by_depth && table.says(limit) {
        return Err(table.exclusive(limit, depth));
    }
    let target = if by_depth {
        Target::Depth { depth_m: table.need(depth, Allowed::DEPTH_MM)? }
    } else if let Some(force_n) = table.number(force, Allowed::FORCE_N)? {
        Target::Force { force_n, depth_limit_m: table.need(limit, Allowed::DEPTH_MM)? }
    } else {
        if let Some(value) = table.find(limit) {
            return Err(table.wrong(limit, value, "until_force_n beside it"));
        }
        return Ok(None);
    };
    Ok(Some(Profile::Press { target, hold_s }))
}

fn cycles(step: &Section<'_, '_>) -> Result<Profile, Refusal> {
    let offset_m = step.need("offset_mm", Allowed::DEPTH_MM)?;
    let amplitude_m = step.need("amplitude_mm", Allowed::DEPTH_MM)?;
    let count = step.count("cycles")?.ok_or_else(|| step.missing("cycles", "how often"))?;
    match step.find("amplitude_mm") {
        Some(value) if amplitude_m > offset_m => {
            let expected =
                format!("at most offset_mm, which is {}: the tip would leave the phantom", offset_m * 1e3);
            Err(step.wrong("amplitude_mm", value, expected))
        }
        _ => Ok(Profile::Cycles { offset_m, amplitude_m, count }),
    }
}

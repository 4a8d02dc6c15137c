//! The pictures of a session → its markers, for every command that needs them.

use super::Context;
use crate::calib::{Lag, Registration, RegistrationFile};
use crate::dataset::{Attached, Eye, Followed, RestingDot, attach_dots, dots_at_rest, first_rest, follow};
use crate::geometry::Vec3;
use crate::mesh::TetMesh;
use crate::session::{CameraDocument, Session, Topic};
use crate::track::Settings;
use anyhow::{Context as _, bail};
use std::path::Path;

/// What the pictures of a session show.
pub(super) struct Looked {
    pub(super) eye: Eye,
    pub(super) followed: Followed,
    /// The dots before the first poke, in the camera frame.
    pub(super) resting: Vec<RestingDot>,
}

/// A marker rests at most so far from the phantom's surface (m).
pub(super) const ON_SURFACE_M: f64 = 0.005;

/// A dot that rests so close to where it did in an earlier session is the same (m): a fraction of the distance between dots.
const SAME_M: f64 = 0.002;

/// Follows the dots through the pictures of a session; none where it has no pictures.
pub(super) fn look(
    session: &Session,
    settings: Settings,
    context: &Context,
) -> anyhow::Result<Option<Looked>> {
    let Some(camera) = &session.start().camera else { return Ok(None) };
    let frames = session.info()?.topics.get(&Topic::Frame).map_or(0, |extent| extent.messages);
    if frames == 0 {
        return Ok(None);
    }
    let eye = Eye::of(camera, settings)
        .with_context(|| format!("{}: nothing is known of the camera's lens", session.folder().display()))?;
    let rest = first_rest(session)?;
    let bar = context.progress.bar("following the dots", frames);
    let followed = follow(session, &eye, rest, &mut || bar.advance())
        .with_context(|| session.folder().display().to_string())?;
    let resting = dots_at_rest(&followed, rest[0], rest[1]);
    Ok(Some(Looked { eye, followed, resting }))
}

/// How the camera of a session lies: as `file` says, otherwise as was known when it was recorded.
pub(super) fn registration(camera: &CameraDocument, file: Option<&Path>) -> anyhow::Result<Registration> {
    let (text, name) = match (file, &camera.registration) {
        (Some(file), _) => {
            let name = file.display().to_string();
            (std::fs::read_to_string(file).with_context(|| format!("{name}: can't be read"))?, name)
        }
        (None, Some(kept)) => (kept.text.clone(), "the registration that the session keeps".to_owned()),
        (None, None) => bail!(
            "where the camera stands is not known: find out with `phantom-rig calibrate registration`, then pass --registration"
        ),
    };
    Ok(RegistrationFile::parse(&text).context(name)?.registration())
}

/// Points of the bench that the camera sees, in the phantom frame (m).
pub(super) fn fiducials(camera: &CameraDocument) -> Vec<Vec3> {
    camera.fiducials_m.iter().copied().map(Vec3::from).collect()
}

/// Sessions in order with the markers that their pictures show, numbered alike in all of them.
pub(super) fn seen(
    sessions: &[Session],
    mesh: &TetMesh,
    context: &Context,
) -> anyhow::Result<Vec<(Session, Option<Attached>)>> {
    let mut all: Vec<(Session, Option<Attached>)> = Vec::new();
    for session in sessions {
        let mut shown = markers(session, mesh, context)?;
        if let (Some(shown), Some(first)) = (&mut shown, all.iter().find_map(|(_, a)| a.as_ref())) {
            shown.number_after(first, SAME_M);
        }
        all.push((session.clone(), shown));
    }
    Ok(all)
}

/// The markers of a session with pictures; none where it has none, or where nobody knows where the camera stood.
fn markers(session: &Session, mesh: &TetMesh, context: &Context) -> anyhow::Result<Option<Attached>> {
    let Some(camera) =
        session.start().camera.as_ref().filter(|c| c.registration.is_some() && c.lens.is_some())
    else {
        return Ok(None);
    };
    let registration = registration(camera, None)?;
    let looked = look(session, Settings::default(), context)?;
    let known = fiducials(camera);
    Ok(looked.map(|l| attach_dots(&l.followed, &l.resting, &registration, mesh, &known, ON_SURFACE_M)))
}

/// What is said of pictures that come late.
pub(super) fn late(lag: &Lag) -> String {
    let (ms, sd_ms) = (1e3 * lag.lag_s, 1e3 * lag.sd_s);
    format!("pictures come {ms:.1} ± {sd_ms:.1} ms after what they show; that is taken off")
}

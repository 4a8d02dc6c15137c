//! The pictures of a session → its markers, for every command that needs them.

use super::Context;
use crate::calib::{Lag, Registration, RegistrationFile};
use crate::dataset::{Attached, Eye, Followed, RestingDot, attach_dots, dots_at_rest, first_rest, follow};
use crate::geometry::Vec3;
use crate::mesh::TetMesh;
use crate::session::{CameraDocument, Session, Topic};
use crate::track::Settings;
use crate::units::counted;
use anyhow::{Context as _, bail};
use std::path::Path;

/// What the pictures of a session show.
pub(super) struct Looked {
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
    Ok(Some(Looked { followed, resting }))
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

/// How the camera of a session lies, where it has one: as `file` says, otherwise as was known when it was recorded. Refuses a session whose
/// dots would have no place in the phantom frame: a recording of it would have no markers.
pub(super) fn placed(session: &Session, file: Option<&Path>) -> anyhow::Result<Option<Registration>> {
    let name = session.folder().display();
    let Some(camera) = &session.start().camera else {
        if let Some(file) = file {
            bail!("{name}: it has no pictures, for which {} says where the camera stood", file.display());
        }
        return Ok(None);
    };
    if camera.lens.is_none() {
        bail!(
            "{name}: the lens of its camera is not known, so that none of its dots has a place in the phantom frame: name a lens in the rig \
             file (`phantom-rig calibrate camera` makes one) and record again; `session export --csv` writes what there is without"
        );
    }
    if camera.registration.is_none() && file.is_none() {
        bail!(
            "{name}: where its camera stood is not known, so that none of its dots has a place in the phantom frame: find it out with \
             `phantom-rig calibrate registration SESSION --out FILE`, then pass `--registration FILE` to `session export`, or name FILE in \
             the rig file and record again; `session export --csv` writes what there is without"
        );
    }
    Ok(Some(registration(camera, file)?))
}

/// Sessions in order with the markers that their pictures show, numbered alike in all of them. Where the camera stood: as `file` says,
/// otherwise as each session does.
pub(super) fn seen(
    sessions: &[Session],
    mesh: &TetMesh,
    file: Option<&Path>,
    context: &Context,
) -> anyhow::Result<Vec<(Session, Option<Attached>)>> {
    // Before any pictures are followed, which takes a while.
    let placed: Vec<_> = sessions.iter().map(|s| placed(s, file)).collect::<anyhow::Result<_>>()?;
    let mut all: Vec<(Session, Option<Attached>)> = Vec::new();
    for (session, registration) in sessions.iter().zip(placed) {
        let mut shown = markers(session, registration, mesh, context)?;
        if let (Some(shown), Some(first)) = (&mut shown, all.iter().find_map(|(_, a)| a.as_ref())) {
            shown.number_after(first, SAME_M);
        }
        all.push((session.clone(), shown));
    }
    Ok(all)
}

/// The markers of a session with pictures; none where it has none.
fn markers(
    session: &Session,
    registration: Option<Registration>,
    mesh: &TetMesh,
    context: &Context,
) -> anyhow::Result<Option<Attached>> {
    let (Some(camera), Some(registration)) = (&session.start().camera, registration) else {
        return Ok(None);
    };
    let looked = look(session, Settings::default(), context)?;
    let known = fiducials(camera);
    Ok(looked.map(|l| attach_dots(&l.followed, &l.resting, &registration, mesh, &known, ON_SURFACE_M)))
}

/// What is said of pictures that did not come; nothing where all did, or where the camera keeps no beat.
pub(super) fn missing(on_beat: Option<u64>) -> Option<String> {
    let count = on_beat.filter(|count| *count > 0)?;
    Some(format!("{} missing on the camera's beat", counted(count as usize, "picture", "pictures")))
}

/// What is said of pictures that come late.
pub(super) fn late(lag: &Lag) -> String {
    let (ms, sd_ms) = (1e3 * lag.lag_s, 1e3 * lag.sd_s);
    format!("pictures come {ms:.1} ± {sd_ms:.1} ms after what they show; that is taken off")
}

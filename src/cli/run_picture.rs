//! What the camera sees during a run: a file that is written when somebody asks, or every second.

use super::seen_dots::{LEGEND, caption, marked};
use crate::acquire::{SeenPicture, Watched};
use crate::clock::HostTime;
use crate::report::{MarkedPicture, strip};
use anyhow::Context as _;
use std::fs::Permissions;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// So often where nobody has to ask.
const EVERY: Duration = Duration::from_secs(1);

/// Permissions of a new file before the system's mask takes some away.
const EVERYBODY: u32 = 0o666;

/// The file and when it is due.
pub(super) struct LivePicture {
    file: PathBuf,
    /// When the session began.
    began: HostTime,
    /// When the next is asked for; none where somebody has to ask.
    due: Option<HostTime>,
    /// What became of the last, for the screen.
    note: String,
}

impl LivePicture {
    /// Beside a session that began then. `live`: every second.
    pub(super) fn beside(session: &Path, began: HostTime, live: bool) -> Self {
        let mut file = session.as_os_str().to_owned();
        file.push("-live.png");
        Self { file: file.into(), began, due: live.then(HostTime::now), note: String::new() }
    }

    /// Asks for a picture when it is time, and writes the one that is there.
    pub(super) fn look(&mut self, watched: &Watched) {
        if let Some(due) = self.due.filter(|due| due.remaining().is_zero()) {
            watched.ask_picture();
            self.due = Some(due + EVERY);
        }
        if let Some(seen) = watched.take_picture() {
            self.note = match self.write(&seen) {
                Ok(()) => format!("picture: {}", self.file.display()),
                // No reason to give up a run.
                Err(error) => format!("no picture: {error:#}"),
            };
        }
    }

    /// What became of the last picture; empty before the first.
    pub(super) fn note(&self) -> &str {
        &self.note
    }

    /// Whole or not at all, so that a viewer that reads again and again never sees half of one.
    fn write(&self, seen: &SeenPicture) -> anyhow::Result<()> {
        let picture = MarkedPicture {
            size_px: [seen.grey.width, seen.grey.height],
            levels: &seen.grey.pixels,
            dots: marked(&seen.dots),
            caption: caption(seen.host.seconds_after(self.began), seen.number, &seen.dots),
        };
        let png = strip(&[picture], &LEGEND)?;
        let folder = self.file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let cannot = || format!("{}: can't be written", self.file.display());
        // As any other file is made: whom the system's mask lets read it, may.
        let mut new = tempfile::Builder::new()
            .permissions(Permissions::from_mode(EVERYBODY))
            .tempfile_in(folder)
            .with_context(cannot)?;
        new.write_all(&png).with_context(cannot)?;
        new.persist(&self.file).with_context(cannot)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{DotInPicture, GreyPicture, Sight};

    #[test]
    fn a_picture_is_written_with_its_rings_and_says_where() {
        let place = tempfile::tempdir().expect("a folder");
        let mut picture =
            LivePicture::beside(&place.path().join("monday"), HostTime::from_nanos(5_000_000_000), false);
        let grey = GreyPicture { width: 40, height: 30, pixels: vec![100; 1200] };
        let dot = |x, sight| DotInPicture { number: Some(7), centre_px: [x, 15.0], radius_px: 4.0, sight };
        let dots = vec![dot(10.0, Sight::Certain), dot(30.0, Sight::Lost)];
        let seen = SeenPicture { host: HostTime::from_nanos(6_000_000_000), number: 30, grey, dots };
        picture.write(&seen).expect("written");
        let mode = |name: &str| {
            let permissions = place.path().join(name).metadata().expect("a file").permissions();
            permissions.mode() & 0o777
        };
        std::fs::write(place.path().join("other"), "").expect("writable");
        assert_eq!(mode("monday-live.png"), mode("other"), "as any other file");
        let drawn = image::open(place.path().join("monday-live.png")).expect("a picture").into_rgb8();
        let count = |first: usize, second: usize| {
            drawn.pixels().filter(|p| p.0[first] > p.0[second].saturating_add(50)).count()
        };
        assert!(count(1, 0) > 10 && count(0, 1) > 10, "green and red rings");
        assert_eq!(picture.note(), "");
        picture.look(&Watched::default());
        assert_eq!(picture.note(), "", "nobody has asked");
    }
}

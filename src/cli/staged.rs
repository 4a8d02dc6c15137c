//! How results reach the disk whole or not at all.
//!
//! Results are written into a staging folder beside their destination and renamed into place at the end. An
//! error drops the staging folder; Ctrl-C removes all of them and exits with 130. A result folder carries the
//! file [`MARK`], which says what it is. What can be made again from a recording is replaced by its own kind; a recording,
//! and whatever else is there, only with `--force`; a session never is.

use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The file by which this program knows a result folder of its own.
const MARK: &str = ".phantom-rig";

/// Permission of a folder's owner to change it.
const OWNER_WRITES: u32 = 0o200;

/// What a result folder holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A recording: it cannot be made again.
    Recording,
    /// A fit.
    Fit,
    /// A diagnosis.
    Diagnosis,
    /// The tables of an experiment.
    Experiment,
    /// A session's tables.
    Tables,
    /// The dots of a session's pictures.
    Tracks,
    /// The dots of pictures.
    Dots,
    /// What an instrument is worth.
    Calibration,
    /// Files of this program that are needed only while it runs.
    Scratch,
}

impl Kind {
    /// What it is called.
    pub fn word(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Fit => "fit",
            Self::Diagnosis => "diagnosis",
            Self::Experiment => "experiment",
            Self::Tables => "tables",
            Self::Tracks => "tracks",
            Self::Dots => "dots",
            Self::Calibration => "calibration",
            Self::Scratch => "scratch",
        }
    }

    fn mark(self) -> String {
        format!("written by phantom-rig {}: {}\n", env!("CARGO_PKG_VERSION"), self.word())
    }

    /// Whether a folder holds what one of this kind may replace.
    fn may_replace(self, folder: &Path) -> bool {
        let Ok(mark) = std::fs::read_to_string(folder.join(MARK)) else { return false };
        let said = mark.trim_end().rsplit_once(": ").map(|(_, kind)| kind);
        self != Self::Recording && said == Some(self.word())
    }
}

/// Why results could not be put in place.
#[derive(Debug, thiserror::Error)]
pub enum StagedError {
    /// The destination is taken.
    #[error("{} exists, and is nothing that a new {} replaces; choose another place or pass --force", place.display(), kind.word())]
    Taken {
        /// The destination.
        place: PathBuf,
        /// What was to be put there.
        kind: Kind,
    },
    /// The destination file exists.
    #[error("{} exists; choose another name or pass --force", place.display())]
    Exists {
        /// The destination.
        place: PathBuf,
    },
    /// The destination of a file is a folder.
    #[error("{} is a folder; expected the name of a file", place.display())]
    Folder {
        /// The destination.
        place: PathBuf,
    },
    /// Something is where a session should go. Sessions are never overwritten.
    #[error("{}: exists already; a session goes into a folder that does not exist yet", place.display())]
    SessionExists {
        /// The destination.
        place: PathBuf,
    },
    /// The destination has no name of its own, such as `..`.
    #[error("{} is no name for a result", place.display())]
    NoName {
        /// The destination.
        place: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: can't be {action}", place.display())]
    System {
        /// File or folder.
        place: PathBuf,
        /// What was tried.
        action: &'static str,
        /// Why.
        source: io::Error,
    },
}

/// Staging folders that exist now: what Ctrl-C removes. The lock is held while results are moved into place,
/// so that an interruption finds them either staged or whole.
static STAGED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Staging folders made so far, so that each has a name of its own.
static COUNT: AtomicUsize = AtomicUsize::new(0);

fn staged() -> MutexGuard<'static, Vec<PathBuf>> {
    STAGED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes everything that is staged, before the program is ended.
pub(super) fn remove_staged() {
    let folders = staged();
    for folder in folders.iter() {
        remove(folder);
    }
    // Never given back: nothing may be staged or moved into place any more.
    std::mem::forget(folders);
}

/// Removes a folder into which somebody may still be writing.
fn remove(folder: &Path) {
    for _ in 0..100 {
        match std::fs::remove_dir_all(folder) {
            // A session that is finished is read-only.
            Err(e) if e.kind() == io::ErrorKind::PermissionDenied => unseal(folder),
            Err(e) if e.kind() != io::ErrorKind::NotFound => std::thread::yield_now(),
            _ => return,
        }
    }
}

/// Lets what is in a folder be removed, as far as the system allows.
fn unseal(folder: &Path) {
    if let Ok(known) = folder.metadata() {
        let mut permissions = known.permissions();
        permissions.set_mode(permissions.mode() | OWNER_WRITES);
        let _ = std::fs::set_permissions(folder, permissions);
    }
}

/// A folder that appears at its destination when it is complete.
#[derive(Debug)]
pub struct StagedFolder {
    staging: Staging,
    destination: PathBuf,
    kind: Kind,
    /// Whether something may be there at the end.
    replaces: bool,
}

impl StagedFolder {
    /// Prepares a result folder for `destination`. A folder that is there already is replaced at the end when it is an earlier result
    /// of the same kind, but for recordings, when it is empty, or when `force` is given.
    ///
    /// # Errors
    /// The destination is taken or can't be written to.
    pub fn new(destination: &Path, kind: Kind, force: bool) -> Result<Self, StagedError> {
        let is_empty = || destination.read_dir().is_ok_and(|mut entries| entries.next().is_none());
        let exists = destination.symlink_metadata().is_ok();
        if exists && !(force || kind.may_replace(destination) || is_empty()) {
            return Err(StagedError::Taken { place: destination.to_owned(), kind });
        }
        let staging = Staging::beside(destination)?;
        let mark = staging.folder.join(MARK);
        std::fs::write(&mark, kind.mark()).map_err(|e| system(&mark, "written", e))?;
        Ok(Self { staging, destination: destination.to_owned(), kind, replaces: force || exists })
    }

    /// Where to write until the end.
    pub fn path(&self) -> &Path {
        &self.staging.folder
    }

    /// Puts the folder in place. On an error what was there before is still there.
    ///
    /// # Errors
    /// Something has come to be there meanwhile, or the operating system refused.
    pub fn finish(self) -> Result<(), StagedError> {
        let _guard = staged();
        let Self { staging, destination, kind, replaces } = &self;
        let exists = destination.symlink_metadata().is_ok();
        if exists && !replaces {
            return Err(StagedError::Taken { place: destination.clone(), kind: *kind });
        }
        let mut old = staging.folder.clone().into_os_string();
        old.push("-old");
        let old = PathBuf::from(old);
        if exists {
            std::fs::rename(destination, &old).map_err(|e| system(destination, "moved away", e))?;
        }
        if let Err(e) = std::fs::rename(&staging.folder, destination) {
            if exists {
                std::fs::rename(&old, destination).map_err(|e| system(&old, "moved back", e))?;
            }
            return Err(system(destination, "put in place", e));
        }
        if exists {
            let removed =
                if old.is_dir() { std::fs::remove_dir_all(&old) } else { std::fs::remove_file(&old) };
            removed.map_err(|e| system(&old, "removed", e))?;
        }
        Ok(())
    }
}

/// A file that appears at its destination when it is complete.
#[derive(Debug)]
pub struct StagedFile {
    staging: Staging,
    destination: PathBuf,
    /// Whether something may be there at the end.
    replaces: bool,
}

impl StagedFile {
    /// Prepares a result file for `destination`; a file that is there already is replaced only with `force`.
    ///
    /// # Errors
    /// The destination exists, is a folder or can't be written to.
    pub fn new(destination: &Path, force: bool) -> Result<Self, StagedError> {
        if destination.is_dir() {
            return Err(StagedError::Folder { place: destination.to_owned() });
        }
        if !force && destination.symlink_metadata().is_ok() {
            return Err(StagedError::Exists { place: destination.to_owned() });
        }
        Ok(Self {
            staging: Staging::beside(destination)?,
            destination: destination.to_owned(),
            replaces: force,
        })
    }

    /// Where to write until the end.
    pub fn path(&self) -> PathBuf {
        self.staging.folder.join("result")
    }

    /// Puts the file in place.
    ///
    /// # Errors
    /// Something has come to be there meanwhile, or the operating system refused.
    pub fn finish(self) -> Result<(), StagedError> {
        let _guard = staged();
        if !self.replaces && self.destination.symlink_metadata().is_ok() {
            return Err(StagedError::Exists { place: self.destination.clone() });
        }
        std::fs::rename(self.path(), &self.destination)
            .map_err(|e| system(&self.destination, "put in place", e))
    }
}

/// A session that appears at its destination when it is complete. Whoever writes a session makes its folder, so that until then there is
/// a name only.
#[derive(Debug)]
pub struct StagedSession {
    staging: Staging,
    destination: PathBuf,
}

impl StagedSession {
    /// Prepares a session for `destination`, where nothing may be.
    ///
    /// # Errors
    /// The destination exists, or the folder that it should lie in does not.
    pub fn new(destination: &Path) -> Result<Self, StagedError> {
        if destination.symlink_metadata().is_ok() {
            return Err(StagedError::SessionExists { place: destination.to_owned() });
        }
        let staging = Staging::named(destination, |_| Ok(()))?;
        let parent = parent(destination);
        parent.read_dir().map_err(|e| system(parent, "written into", e))?;
        Ok(Self { staging, destination: destination.to_owned() })
    }

    /// Where to write it until the end: a folder that does not exist yet.
    pub fn path(&self) -> &Path {
        &self.staging.folder
    }

    /// Puts the session in place.
    ///
    /// # Errors
    /// The destination has come to exist meanwhile, or the operating system refused.
    pub fn finish(self) -> Result<(), StagedError> {
        let _guard = staged();
        let Self { staging, destination } = &self;
        if destination.symlink_metadata().is_ok() {
            return Err(StagedError::SessionExists { place: destination.clone() });
        }
        std::fs::rename(&staging.folder, destination).map_err(|e| system(destination, "put in place", e))
    }
}

/// The folder that something lies in.
fn parent(place: &Path) -> &Path {
    place.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A folder beside the destination, hence on the same file system, that is removed when dropped.
#[derive(Debug)]
struct Staging {
    folder: PathBuf,
}

impl Staging {
    /// Makes the folder.
    fn beside(destination: &Path) -> Result<Self, StagedError> {
        Self::named(destination, |folder| {
            std::fs::create_dir(folder).map_err(|e| match e.kind() {
                io::ErrorKind::NotFound => system(parent(destination), "written into", e),
                _ => system(folder, "made", e),
            })
        })
    }

    /// A folder of a name that no other has. While it is being made, nothing is removed.
    fn named(
        destination: &Path,
        make: impl FnOnce(&Path) -> Result<(), StagedError>,
    ) -> Result<Self, StagedError> {
        let name = destination
            .file_name()
            .ok_or_else(|| StagedError::NoName { place: destination.to_owned() })?
            .to_string_lossy();
        let mut list = staged();
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = parent(destination).join(format!(".{name}.partial-{}-{count}", std::process::id()));
        make(&folder)?;
        list.push(folder.clone());
        Ok(Self { folder })
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        let mut list = staged();
        remove(&self.folder);
        list.retain(|f| *f != self.folder);
    }
}

fn system(place: &Path, action: &'static str, source: io::Error) -> StagedError {
    StagedError::System { place: place.to_owned(), action, source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("readable")
            .map(|e| e.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_appears_at_the_end_and_is_replaced_by_its_own_kind() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let result = place.path().join("result");
        for content in ["first", "second"] {
            let staged = StagedFolder::new(&result, Kind::Fit, false).expect("free or ours");
            fs::write(staged.path().join(content), content).expect("writable");
            staged.finish().expect("movable");
            assert_eq!(names(place.path()), ["result"]);
            assert_eq!(names(&result), [MARK, content]);
        }
    }

    #[test]
    fn an_abandoned_result_leaves_nothing_and_spoils_nothing() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let result = place.path().join("result");
        drop(StagedFolder::new(&result, Kind::Fit, false).expect("free"));
        drop(StagedFile::new(&result, false).expect("free"));
        assert_eq!(names(place.path()), [""; 0]);
        let kept = StagedFolder::new(&result, Kind::Fit, false).expect("free");
        kept.finish().expect("movable");
        fs::write(StagedFolder::new(&result, Kind::Fit, false).expect("ours").path().join("half"), "")
            .expect("writable");
        assert_eq!(names(&result), [MARK]);
    }

    #[test]
    fn a_recording_is_never_replaced_unasked() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let result = place.path().join("result");
        let make = |kind| StagedFolder::new(&result, kind, false).and_then(StagedFolder::finish);
        make(Kind::Diagnosis).expect("free");
        make(Kind::Diagnosis).expect("the same again");
        for kind in [Kind::Fit, Kind::Recording, Kind::Tables] {
            assert!(matches!(make(kind), Err(StagedError::Taken { .. })), "{kind:?} over a diagnosis");
        }
        StagedFolder::new(&result, Kind::Recording, true).expect("by force").finish().expect("movable");
        fs::write(result.join("force.csv"), "an afternoon").expect("writable");
        for kind in [Kind::Fit, Kind::Recording, Kind::Diagnosis] {
            assert!(matches!(make(kind), Err(StagedError::Taken { .. })), "{kind:?} over a recording");
        }
        // As earlier versions marked theirs: nobody knows what it is.
        fs::write(result.join(MARK), "written by phantom-rig 0.1.0\n").expect("writable");
        assert!(matches!(make(Kind::Fit), Err(StagedError::Taken { .. })));
        assert_eq!(names(&result), [MARK, "force.csv"]);
    }

    #[test]
    fn what_others_made_is_replaced_only_by_force() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let folder = place.path().join("thesis");
        fs::create_dir(&folder).expect("writable");
        fs::write(folder.join("chapter.tex"), "years").expect("writable");
        assert!(matches!(StagedFolder::new(&folder, Kind::Fit, false), Err(StagedError::Taken { .. })));
        assert_eq!(names(&folder), ["chapter.tex"]);
        let file = folder.join("chapter.tex");
        assert!(matches!(StagedFile::new(&file, false), Err(StagedError::Exists { .. })));
        for force in [false, true] {
            let error = StagedFile::new(&folder, force).expect_err("a folder");
            assert!(matches!(error, StagedError::Folder { .. }));
            assert!(!error.to_string().contains("--force"), "{error}");
        }
        StagedFolder::new(&folder, Kind::Fit, true).expect("by force").finish().expect("movable");
        assert_eq!(names(&folder), [MARK]);
    }

    #[test]
    fn nothing_that_appeared_meanwhile_is_replaced_but_by_force() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let (folder, file) = (place.path().join("fit"), place.path().join("mesh.msh"));
        for force in [false, true] {
            let one = StagedFolder::new(&folder, Kind::Fit, force).expect("free");
            fs::create_dir(&folder).expect("not there yet");
            fs::write(folder.join("chapter.tex"), "years").expect("writable");
            assert_eq!(matches!(one.finish(), Err(StagedError::Taken { .. })), !force);
            assert_eq!(names(&folder), [if force { MARK } else { "chapter.tex" }]);
            fs::remove_dir_all(&folder).expect("ours");

            let one = StagedFile::new(&file, force).expect("free");
            fs::write(one.path(), "new").expect("writable");
            fs::write(&file, "old").expect("writable");
            assert_eq!(matches!(one.finish(), Err(StagedError::Exists { .. })), !force);
            assert_eq!(fs::read_to_string(&file).expect("there"), if force { "new" } else { "old" });
            fs::remove_file(&file).expect("ours");
        }
        assert_eq!(names(place.path()), [""; 0], "what was staged is gone");
    }

    /// As a session is finished: read-only, folder and files.
    fn sealed_session(folder: &Path) {
        fs::create_dir(folder).expect("not there yet");
        fs::write(folder.join("session.mcap"), "an afternoon").expect("writable");
        let mut permissions = folder.metadata().expect("there").permissions();
        permissions.set_readonly(true);
        fs::set_permissions(folder, permissions).expect("ours");
    }

    #[test]
    fn a_session_appears_at_the_end_and_never_in_the_place_of_something() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let session = place.path().join("again");
        let staged = StagedSession::new(&session).expect("free");
        assert_eq!(names(place.path()), [""; 0], "a name only");
        sealed_session(staged.path());
        assert!(!session.exists());
        staged.finish().expect("movable");
        assert_eq!(names(place.path()), ["again"]);
        let error = StagedSession::new(&session).expect_err("taken");
        assert!(error.to_string().contains("again: exists already"), "{error}");
        unseal(&session);

        let other = place.path().join("other");
        let staged = StagedSession::new(&other).expect("free");
        sealed_session(staged.path());
        fs::create_dir(&other).expect("writable");
        assert!(matches!(staged.finish(), Err(StagedError::SessionExists { .. })));
        assert_eq!(names(place.path()), ["again", "other"], "what was staged is gone");
        let error = StagedSession::new(&place.path().join("no/such")).expect_err("nowhere");
        assert!(error.to_string().contains("no: can't be written into"), "{error}");
    }

    #[test]
    fn an_abandoned_session_leaves_nothing_even_when_it_is_read_only() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let staged = StagedSession::new(&place.path().join("again")).expect("free");
        sealed_session(staged.path());
        drop(staged);
        assert_eq!(names(place.path()), [""; 0]);
        drop(StagedSession::new(&place.path().join("again")).expect("free"));
    }

    #[test]
    fn a_place_that_does_not_exist_is_named() {
        let error = StagedFile::new(Path::new("/no/such/folder/mesh.msh"), false).expect_err("nowhere");
        assert!(error.to_string().contains("/no/such/folder"), "{error}");
        assert!(matches!(
            StagedFolder::new(Path::new("a/.."), Kind::Fit, true),
            Err(StagedError::NoName { .. })
        ));
    }
}

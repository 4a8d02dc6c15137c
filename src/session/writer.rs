//! How a session is recorded: created, handed records from several threads, finished and sealed; or gone on with after an interruption.
//!
//! One thread takes messages from the queue and writes them out at least every 100 ms; another has the disk keep them at least once a
//! second (`sync_data` may take longer than a kill may cost, so it must not hold up the first).

use super::document::{FORMAT, Outcome, StartDocument, StopDocument, to_json};
use super::message::Message;
use super::read::Session;
use super::recorder::{CAPACITY, Entry, Health, Recorder, Shared};
use super::scribe::Scribe;
use super::{SessionError, Topic};
use crate::clock::HostTime;
use crate::device::Losses;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// The manifest: the start document of the first segment.
pub(super) const MANIFEST: &str = "manifest.json";

/// The disk is told to keep what was written so often.
const SYNC_EVERY: Duration = Duration::from_millis(500);

/// Permission of a folder's owner to change it.
const OWNER_WRITES: u32 = 0o200;

/// The writing thread looks around so often when nothing comes.
const IDLE: Duration = Duration::from_millis(50);

/// Name of a segment's file.
pub(super) fn segment_file(folder: &Path, segment: u32) -> PathBuf {
    match segment {
        ..=1 => folder.join("session.mcap"),
        later => folder.join(format!("session-{later}.mcap")),
    }
}

/// A session being recorded. Dropped without [`finish`](Self::finish), it leaves an interrupted session.
#[derive(Debug)]
pub struct SessionWriter {
    folder: PathBuf,
    file: PathBuf,
    queue: SyncSender<Entry>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Option<StopDocument>>>,
    /// The file, locked: who would go on with this session sees that it is being recorded. A killed process holds no locks.
    lock: File,
}

impl SessionWriter {
    /// Begins a session in `folder`, which must not exist. The start document is on the disk when this returns; its `format` and
    /// `segment` are filled in.
    ///
    /// # Errors
    /// [`SessionError`]: something is there already, it can't be written, a value of the document is not finite.
    pub fn create(folder: &Path, start: StartDocument) -> Result<Self, SessionError> {
        let start = create_folder(folder, start)?;
        Self::begin(folder, start, |file| file)
    }

    /// Goes on with a session that was interrupted or stopped: a new segment beside the ones that are there, which stay as they are.
    ///
    /// # Errors
    /// [`SessionError`]: it came to its end, it is being recorded, it had another name, rig or protocol, it can't be written.
    pub fn continue_session(folder: &Path, start: StartDocument) -> Result<Self, SessionError> {
        let session = Session::open(folder)?;
        if session.stop().is_some_and(|stop| stop.outcome == Outcome::Success) {
            return Err(SessionError::Finished { folder: folder.to_owned() });
        }
        session.begun_with(&start.name, &start.rig, &start.protocol, &start.variables)?;
        let meshes = [&session.start().phantom, &start.phantom].map(|p| p.mesh_sha256.as_ref());
        if let [Some(recorded), Some(given)] = meshes
            && recorded != given
        {
            let (recorded, given) = (recorded.clone(), given.clone());
            let what = "phantom's mesh";
            return Err(SessionError::Different { folder: folder.to_owned(), what, recorded, given });
        }
        let last = segment_file(folder, session.segments());
        let file = File::open(&last).map_err(SessionError::read(&last))?;
        if file.try_lock_shared().is_err() {
            return Err(SessionError::InUse { file: last });
        }
        unseal(folder)?;
        Self::begin(
            folder,
            StartDocument { format: FORMAT.to_owned(), segment: session.segments() + 1, ..start },
            |file| file,
        )
    }

    /// `sink` says what stands between the writing thread and the file: nothing, outside tests.
    fn begin<W: Write + Send + 'static>(
        folder: &Path,
        start: StartDocument,
        sink: impl FnOnce(File) -> W,
    ) -> Result<Self, SessionError> {
        let path = segment_file(folder, start.segment);
        let file = create_new(&path)?;
        // Where files can't be locked, nobody sees it; recording goes on.
        let _ = file.try_lock();
        let [lock, for_disk] = [file.try_clone(), file.try_clone()];
        let (lock, for_disk) =
            (lock.map_err(SessionError::write(&path))?, for_disk.map_err(SessionError::write(&path))?);
        let mut scribe = Scribe::begin(sink(file), &path)?;
        scribe.write(Message::Start(Box::new(start)))?;
        scribe.flush()?;
        for_disk.sync_all().map_err(SessionError::write(&path))?;
        sync_folder(folder)?;
        let shared = Arc::new(Shared::default());
        let disk = Disk::spawn(for_disk, &path, &shared)?;
        let (queue, entries) = sync_channel(CAPACITY);
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("session-writer".to_owned())
            .spawn(move || match take_down(scribe, &entries, &theirs, &disk) {
                Ok(stop) => stop,
                Err(error) => {
                    theirs.fail(error);
                    None
                }
            })
            .map_err(SessionError::write(&path))?;
        Ok(Self { folder: folder.to_owned(), file: path, queue, shared, thread: Some(thread), lock })
    }

    /// As [`create`](Self::create), but the writing thread is held up when it first writes something out: it says so to `held_up`, and
    /// goes on when the other end of `gate` is gone.
    #[cfg(test)]
    pub(super) fn create_held_up(
        folder: &Path,
        start: StartDocument,
        held_up: SyncSender<()>,
        gate: Receiver<()>,
    ) -> Result<Self, SessionError> {
        struct HeldUp {
            file: File,
            held_up: SyncSender<()>,
            gate: Receiver<()>,
            has_begun: bool,
        }
        impl Write for HeldUp {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                if self.has_begun {
                    let _ = self.held_up.try_send(());
                    let _ = self.gate.recv();
                }
                self.file.write(bytes)
            }
            fn flush(&mut self) -> io::Result<()> {
                self.has_begun = true;
                self.file.flush()
            }
        }
        let start = create_folder(folder, start)?;
        Self::begin(folder, start, |file| HeldUp { file, held_up, gate, has_begun: false })
    }

    /// A way in for one thread.
    pub fn recorder(&self) -> Recorder {
        Recorder::new(self.queue.clone(), Arc::clone(&self.shared))
    }

    /// How recording is going; asked from any thread, without waiting.
    pub fn health(&self) -> Health {
        Health(Arc::clone(&self.shared))
    }

    /// Ends the session: everything that was handed over is written, then the stop document; the disk has it, and files and folder
    /// are read-only. Drop the recorders before: what they still collect, and what they hand over later, is not in it.
    ///
    /// `sensor`: what became of the force records on their way to the host. `stopped`: now, on the clock that the records are timed by.
    ///
    /// # Errors
    /// [`SessionError`]: recording had failed, or this does.
    pub fn finish(
        mut self,
        outcome: Outcome,
        sensor: Losses,
        stopped: HostTime,
    ) -> Result<StopDocument, SessionError> {
        let stop = StopDocument {
            outcome,
            stopped_host_ns: stopped.nanos(),
            messages: Default::default(),
            force_records: 0,
            dropped: Default::default(),
            sensor: sensor.into(),
        };
        // Waits while the queue is full. That the other end is gone shows below.
        let _ = self.queue.send(Entry::Finish(Box::new(stop)));
        let stop = self.thread.take().and_then(|thread| thread.join().ok()).flatten();
        if let Some(error) = self.shared.failure() {
            return Err(error.clone());
        }
        let stop = stop.ok_or_else(|| SessionError::RecorderEnded { file: self.file.clone() })?;
        seal(&self.folder)?;
        Ok(stop)
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            self.shared.abandoned.store(true, Ordering::Relaxed);
            let _ = thread.join();
        }
        // By name: a process that is just being started may still share the handle.
        let _ = self.lock.unlock();
    }
}

/// Writes what comes until the session ends or is abandoned; the stop document when it ended.
fn take_down<W: Write>(
    mut scribe: Scribe<W>,
    entries: &Receiver<Entry>,
    shared: &Shared,
    disk: &Disk,
) -> Result<Option<StopDocument>, SessionError> {
    let mut synced = HostTime::now();
    let mut is_synced = true;
    let stop = loop {
        if shared.abandoned.load(Ordering::Relaxed) {
            // What is there now; somebody may still be handing over more.
            for entry in entries.try_iter().take(CAPACITY) {
                write_entry(&mut scribe, entry)?;
            }
            break None;
        }
        let patience = scribe.due().map_or(IDLE, |due| due.remaining().min(IDLE));
        match entries.recv_timeout(patience) {
            Ok(entry) => {
                if let Entry::Message { message, .. } = &entry {
                    shared.taken(message);
                }
                if let Some(stop) = write_entry(&mut scribe, entry)? {
                    break Some(stop);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break None,
        }
        if let Some(error) = shared.failure() {
            return Err(error.clone());
        }
        let now = HostTime::now();
        if scribe.due().is_some_and(|due| due <= now) {
            scribe.flush()?;
            is_synced = false;
        }
        if !is_synced && now.since(synced) >= SYNC_EVERY {
            disk.keep();
            (synced, is_synced) = (now, true);
        }
    };
    for gap in shared.unsaid() {
        scribe.write(Message::Gap(gap))?;
    }
    let stop = match stop {
        Some(mut stop) => {
            stop.messages = scribe.counts().messages();
            stop.force_records = scribe.counts().force_records;
            let dropped = Topic::ALL.into_iter().map(|t| (t.name().to_owned(), shared.dropped(t)));
            stop.dropped = dropped.filter(|&(_, count)| count > 0).collect();
            scribe.write(Message::Stop(stop.clone()))?;
            Some(*stop)
        }
        None => None,
    };
    scribe.finish()?;
    Ok(stop)
}

/// Writes an entry of the queue, or gives back how the session ends.
fn write_entry<W: Write>(
    scribe: &mut Scribe<W>,
    entry: Entry,
) -> Result<Option<Box<StopDocument>>, SessionError> {
    match entry {
        Entry::Message { missing, message } => {
            if let Some(gap) = missing {
                scribe.write(Message::Gap(gap))?;
            }
            scribe.write(message)?;
            Ok(None)
        }
        Entry::Finish(stop) => Ok(Some(stop)),
    }
}

/// The thread that has the disk keep what was written.
struct Disk {
    wake: SyncSender<()>,
}

impl Disk {
    fn spawn(file: File, path: &Path, shared: &Arc<Shared>) -> Result<Self, SessionError> {
        let (wake, woken) = sync_channel::<()>(1);
        let (shared, name) = (Arc::clone(shared), path.to_owned());
        std::thread::Builder::new()
            .name("session-sync".to_owned())
            .spawn(move || {
                while woken.recv().is_ok() {
                    if let Err(error) = file.sync_data() {
                        shared.fail(SessionError::write(&name)(error));
                        return;
                    }
                }
            })
            .map_err(SessionError::write(path))?;
        Ok(Self { wake })
    }

    /// Has the disk keep what was written so far. When it is still at it, it will do so once more.
    fn keep(&self) {
        let _ = self.wake.try_send(());
    }
}

/// Makes the folder with its manifest.
fn create_folder(folder: &Path, start: StartDocument) -> Result<StartDocument, SessionError> {
    let start = StartDocument { format: FORMAT.to_owned(), segment: 1, ..start };
    let checked = to_json("start document", &start)?;
    fs::create_dir(folder).map_err(exists_or_write(folder))?;
    let manifest = folder.join(MANIFEST);
    // Set out for people; the checked text says the same without line breaks.
    let text = serde_json::to_vec_pretty(&start).unwrap_or(checked);
    let mut file = create_new(&manifest)?;
    file.write_all(&text).and_then(|()| file.sync_all()).map_err(SessionError::write(&manifest))?;
    if let Some(parent) = folder.parent().filter(|p| !p.as_os_str().is_empty()) {
        sync_folder(parent)?;
    }
    Ok(start)
}

fn create_new(path: &Path) -> Result<File, SessionError> {
    OpenOptions::new().write(true).create_new(true).open(path).map_err(exists_or_write(path))
}

fn exists_or_write(path: &Path) -> impl FnOnce(io::Error) -> SessionError {
    let path = path.to_owned();
    move |error| match error.kind() {
        io::ErrorKind::AlreadyExists => SessionError::Exists { path },
        _ => SessionError::write(path)(error),
    }
}

fn sync_folder(folder: &Path) -> Result<(), SessionError> {
    File::open(folder).and_then(|f| f.sync_all()).map_err(SessionError::write(folder))
}

/// Lets a file be added to a folder; those that are there stay read-only.
fn unseal(folder: &Path) -> Result<(), SessionError> {
    let mut permissions = fs::metadata(folder).map_err(SessionError::read(folder))?.permissions();
    if permissions.readonly() {
        permissions.set_mode(permissions.mode() | OWNER_WRITES);
        fs::set_permissions(folder, permissions).map_err(SessionError::write(folder))?;
    }
    Ok(())
}

/// Has the disk keep everything in the folder, and makes it and its files read-only.
pub(super) fn seal(folder: &Path) -> Result<(), SessionError> {
    let read_only = |path: &Path| {
        let mut permissions = fs::metadata(path)?.permissions();
        permissions.set_readonly(true);
        fs::set_permissions(path, permissions)
    };
    for entry in fs::read_dir(folder).map_err(SessionError::read(folder))? {
        let path = entry.map_err(SessionError::read(folder))?.path();
        File::open(&path)
            .and_then(|file| file.sync_all())
            .and_then(|()| read_only(&path))
            .map_err(SessionError::write(&path))?;
    }
    sync_folder(folder)?;
    read_only(folder).map_err(SessionError::write(folder))
}

//! Why a session could not be written, read or continued.

use super::Topic;
use super::frame::{FrameAsked, FrameStamp, Stream};
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

/// Why a session could not be written, read or continued.
#[derive(Debug, Clone, thiserror::Error)]
pub enum SessionError {
    /// There is something where the session should go. Nothing is ever overwritten.
    #[error("{}: exists already", path.display())]
    Exists {
        /// What is there.
        path: PathBuf,
    },
    /// Not a session.
    #[error("{}: no session: {missing} is missing", folder.display())]
    NotASession {
        /// What was given.
        folder: PathBuf,
        /// What every session has.
        missing: &'static str,
    },
    /// What a session was turned into.
    #[error("{}: a recording bundle, not a session; `phantom-rig check` says what is in it", folder.display())]
    IsABundle {
        /// What was given.
        folder: PathBuf,
    },
    /// The operating system refused to read.
    #[error("{}: can't be read", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Arc<io::Error>,
    },
    /// The operating system refused to write: disk full, disk gone, no permission.
    #[error("{}: can't be written", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: Arc<io::Error>,
    },
    /// The thread that writes has ended before its time.
    #[error("{}: the recorder has ended before its time", file.display())]
    RecorderEnded {
        /// The file it wrote.
        file: PathBuf,
    },
    /// Somebody is recording it.
    #[error("{}: is being recorded", file.display())]
    InUse {
        /// The file.
        file: PathBuf,
    },
    /// A finished session is never modified.
    #[error("{}: the session is finished; it can't be continued", folder.display())]
    Finished {
        /// The session.
        folder: PathBuf,
    },
    /// A session goes on with what it began with.
    #[error("{}: {what}: the session began with {recorded}, now it is {given}", folder.display())]
    Different {
        /// The session.
        folder: PathBuf,
        /// Name, rig or protocol.
        what: &'static str,
        /// What is recorded: a name or a hash.
        recorded: String,
        /// What was given.
        given: String,
    },
    /// A document that cannot be written so that it reads the same again: a value that is not finite.
    #[error("the {what} can't be written down: {message}")]
    Unwritable {
        /// Which document.
        what: &'static str,
        /// Why.
        message: String,
    },
    /// A document that is not what it should be.
    #[error("{}: the {what} is not readable: {message}", file.display())]
    Document {
        /// The file that holds it.
        file: PathBuf,
        /// Which document.
        what: &'static str,
        /// Why.
        message: String,
    },
    /// A format that this program does not know.
    #[error("{}: format {found:?}; this program reads {expected:?}", file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// Format of the file.
        found: String,
        /// Format that is read.
        expected: &'static str,
    },
    /// Neither the manifest nor the file holds a readable start document.
    #[error("{}: no readable start document, neither in the manifest nor in the recording", folder.display())]
    NoStart {
        /// The session.
        folder: PathBuf,
    },
    /// Bytes in the middle of a file that no checksum vouches for. What comes after them can be read.
    #[error("{}: {bytes} bytes from byte {offset} on are damaged", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Where the damage begins (bytes from the start of the file).
        offset: u64,
        /// How much is damaged (bytes).
        bytes: u64,
    },
    /// A message that its checksum vouches for and that still does not say what its topic says.
    #[error("{}: message {sequence} of {topic} does not follow its schema", file.display())]
    Payload {
        /// The file.
        file: PathBuf,
        /// Its topic.
        topic: Topic,
        /// Its number.
        sequence: u32,
    },
    /// A message too large for the format.
    #[error("a message of {bytes} bytes for {topic}; at most {most} fit")]
    TooLarge {
        /// Its topic.
        topic: Topic,
        /// Its size (bytes).
        bytes: usize,
        /// Largest size (bytes).
        most: usize,
    },
    /// A replay of a device that the session was recorded without.
    #[error("{}: the session was recorded without a {device}", folder.display())]
    NoDevice {
        /// The session.
        folder: PathBuf,
        /// Which device.
        device: &'static str,
    },
    /// A session without frames of a camera.
    #[error("{}: no frame of a camera was recorded", folder.display())]
    NoFrames {
        /// The session.
        folder: PathBuf,
    },
    /// A frame that lies outside of what was recorded.
    #[error("{}: no frame {asked}: frames go from {first} to {last}", folder.display())]
    OutsideFrames {
        /// The session.
        folder: PathBuf,
        /// Which frame was asked for.
        asked: FrameAsked,
        /// The first frame.
        first: FrameStamp,
        /// The last frame.
        last: FrameStamp,
    },
    /// A frame that did not come, or is not in the recording any more.
    #[error("{}: no frame {asked}: it was lost; those beside it are {before} and {after}", folder.display())]
    FrameLost {
        /// The session.
        folder: PathBuf,
        /// Which frame was asked for.
        asked: FrameAsked,
        /// The last frame before it.
        before: FrameStamp,
        /// The first frame after it.
        after: FrameStamp,
    },
    /// A frame without this picture.
    #[error(
        "{}: {frame} has no {stream} picture: {}; {}", folder.display(),
        if *dropped { "it was dropped because the disk did not keep up" } else { "it was lost" },
        nearest.map_or("nor has any other".to_owned(), |near| format!("the nearest that has one is {near}"))
    )]
    NoPicture {
        /// The session.
        folder: PathBuf,
        /// The frame.
        frame: FrameStamp,
        /// Which picture of it.
        stream: Stream,
        /// Whether it was noticed while recording that the disk did not keep up.
        dropped: bool,
        /// The nearest frame in time that has one.
        nearest: Option<FrameStamp>,
    },
    /// A picture that its checksum vouches for and that is none.
    #[error("{}: the {stream} picture of {frame} is no PNG of {} bits", folder.display(), stream.bits())]
    BadPicture {
        /// The session.
        folder: PathBuf,
        /// The frame.
        frame: FrameStamp,
        /// Which picture of it.
        stream: Stream,
    },
    /// A speed that is no speed.
    #[error("a replay at {times} times the recorded speed; it must be more than 0 and finite")]
    Speed {
        /// What was asked for.
        times: f64,
    },
}

impl SessionError {
    /// What to make of an operating system's refusal to read `file`.
    pub(super) fn read(file: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let file = file.into();
        move |source| Self::Read { file, source: Arc::new(source) }
    }

    /// What to make of an operating system's refusal to write `file`.
    pub(super) fn write(file: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let file = file.into();
        move |source| Self::Write { file, source: Arc::new(source) }
    }
}

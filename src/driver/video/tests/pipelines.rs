//! A live camera whose far end is this test: raw frames written into named pipes, which GStreamer reads.

use crate::clock::HostTime;
use crate::clock::steady::steady;
use crate::device::{DepthCamera, DepthFrame, DeviceError};
use crate::driver::{VideoOptions, VideoSource, open_video};
use rustix::fs::{CWD, Mode, mkfifoat};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

const SIZE: [usize; 2] = [640, 480];
/// Slow enough that a thread which another test keeps waiting does not tear pairs apart.
const RATE_HZ: f64 = 8.0;
const FRAMES: usize = 24;

/// What a pipe's writer is told to write, and what it tells when it has.
struct Writer {
    write: Sender<Vec<u8>>,
    written: Receiver<HostTime>,
    thread: JoinHandle<()>,
}

impl Writer {
    fn new(path: PathBuf) -> Self {
        let (write, asked) = mpsc::channel::<Vec<u8>>();
        let (told, written) = mpsc::channel();
        let thread = thread::spawn(move || {
            // Waits until somebody reads.
            let mut pipe: File = OpenOptions::new().write(true).open(path).expect("a pipe");
            for picture in asked {
                let begun = HostTime::now();
                if pipe.write_all(&picture).is_err() || told.send(begun).is_err() {
                    break;
                }
            }
        });
        Self { write, written, thread }
    }

    /// Has it write a picture.
    fn tell(&self, picture: Vec<u8>) {
        self.write.send(picture).expect("the writer lives");
    }

    /// Closes the pipe.
    fn close(self) {
        drop(self.write);
        drop(self.written);
        self.thread.join().expect("the writer only writes");
    }
}

fn pipe(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR).expect("a named pipe");
    path
}

fn pixels() -> usize {
    SIZE[0] * SIZE[1]
}

/// Grey levels and distances of a frame, all alike: its number, and its number with both bytes used.
fn grey(number: usize) -> Vec<u8> {
    vec![number as u8; pixels()]
}

fn distance(number: usize) -> u16 {
    0x1234 + 257 * number as u16
}

fn depth(number: usize) -> Vec<u8> {
    distance(number).to_le_bytes().repeat(pixels())
}

/// The numbers that are in its pictures.
fn numbers(frame: &DepthFrame) -> [usize; 2] {
    let (level, value) = (frame.grey.pixels[0], frame.depth.values[0]);
    assert!(frame.grey.pixels == vec![level; pixels()] && frame.depth.values == vec![value; pixels()]);
    [usize::from(level), usize::from(value - distance(0)) / 257]
}

fn until(seconds: f64) -> HostTime {
    HostTime::now() + Duration::from_secs_f64(seconds)
}

/// Opens and starts a camera: a first picture is written for it, which is checked and thrown away.
fn started(source: VideoSource) -> Box<dyn DepthCamera> {
    let options = VideoOptions { queue: 2 * FRAMES, ..VideoOptions::new(source, SIZE, RATE_HZ) };
    let mut camera = open_video(&options).expect("open");
    camera.start().expect("started");
    // What comes sooner after the first one than a camera's next would have been lying in a buffer.
    thread::sleep(Duration::from_millis(50));
    camera
}

/// Writes frames at the camera's rate and says when.
fn write_frames(each: impl Fn(usize) -> HostTime) -> Vec<HostTime> {
    let begun = Instant::now();
    let at = |number: usize| {
        let due = Duration::from_secs_f64(number as f64 / RATE_HZ);
        thread::sleep(due.saturating_sub(begun.elapsed()));
        each(number)
    };
    (0..FRAMES).map(at).collect()
}

/// How long after it was written each frame was stamped (s): the median and the worst, printed.
fn delays(name: &str, written: &[HostTime], stamped: &[HostTime]) {
    let mut delays: Vec<f64> = stamped.iter().zip(written).map(|(s, w)| 1e3 * s.seconds_after(*w)).collect();
    delays.sort_by(f64::total_cmp);
    println!(
        "{name}: stamped {:.2} ms after writing, {:.2} ms at worst",
        delays[delays.len() / 2],
        delays[delays.len() - 1]
    );
    assert!(delays[0] >= 0.0, "a frame was stamped {} ms before it was written", -delays[0]);
}

/// A camera on two pipes, after its frames: every one arrived, with its partner.
fn two_pipes(folder: &Path) -> ([Writer; 2], Box<dyn DepthCamera>) {
    let paths = [pipe(folder, "grey pipe"), pipe(folder, "depth pipe")];
    let source = VideoSource::pipes(&paths[0], &paths[1], SIZE, RATE_HZ);
    let writers = paths.map(Writer::new);
    writers[0].tell(grey(0));
    writers[1].tell(depth(0));
    let mut camera = started(source);
    for writer in &writers {
        writer.written.recv().expect("written");
    }
    let written = write_frames(|number| {
        writers[0].tell(grey(number));
        writers[1].tell(depth(number));
        let times = [0, 1].map(|stream: usize| writers[stream].written.recv().expect("written"));
        times[0]
    });
    let mut frames = Vec::new();
    while frames.len() < FRAMES {
        frames.push(camera.frame(until(10.0)).expect("alive").expect("a frame within 10 s"));
    }
    let losses = camera.losses();
    assert_eq!(
        (losses.received, losses.dropped, losses.unpaired, losses.malformed),
        (FRAMES as u64, 0, 0, 0),
        "{losses:?}"
    );
    for (number, frame) in frames.iter().enumerate() {
        assert_eq!(numbers(frame), [number, number]);
        assert_eq!(frame.number, frames[0].number + number as u32);
    }
    let stamped: Vec<HostTime> = frames.iter().map(|frame| frame.host).collect();
    delays("two pipes", &written, &stamped);
    (writers, camera)
}

/// Both pictures of a frame.
fn both(number: usize) -> Vec<u8> {
    [grey(number), depth(number)].concat()
}

/// One pipe for both, with a first frame on its way.
fn stacked(folder: &Path) -> (VideoSource, Writer) {
    let path = pipe(folder, "both");
    let source = VideoSource::stacked_pipe(&path, SIZE, RATE_HZ);
    let writer = Writer::new(path);
    writer.tell(both(0));
    (source, writer)
}

fn died(camera: &mut dyn DepthCamera) -> (DeviceError, Duration) {
    let stopped = Instant::now();
    let error = camera.frame(until(20.0)).expect_err("nobody writes any more");
    println!("noticed after {:?}: {error}", stopped.elapsed());
    (error, stopped.elapsed())
}

#[test]
fn all_frames_of_two_pipes_arrive_in_pairs_and_their_end_is_noticed() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let (writers, mut camera) = two_pipes(folder.path());
        assert_eq!(camera.identity().backend, "GSTREAMER");
        writers.into_iter().for_each(Writer::close);
        let (error, waited) = died(&mut *camera);
        assert!(matches!(error, DeviceError::Lost { .. }), "{error}");
        assert!(waited < Duration::from_secs(1), "{waited:?}");
        assert!(camera.start().is_err(), "what is lost does not start again");
    });
}

#[test]
fn a_camera_that_falls_silent_is_noticed() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let (writers, mut camera) = two_pipes(folder.path());
        // The pipes stay open: the threads that grab hang, and nobody else does.
        let (error, waited) = died(&mut *camera);
        assert!(matches!(error, DeviceError::Silent { .. }), "{error}");
        assert!(waited < Duration::from_secs(1), "{waited:?}");
        let begun = Instant::now();
        drop(camera);
        assert!(begun.elapsed() < Duration::from_secs(1), "letting go took {:?}", begun.elapsed());
        writers.into_iter().for_each(Writer::close);
    });
}

/// Both pictures in one pipe: nothing has to be paired.
#[test]
fn all_frames_of_a_stacked_pipe_arrive() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let (source, writer) = stacked(folder.path());
        let mut camera = started(source);
        writer.written.recv().expect("written");
        let written = write_frames(|number| {
            writer.tell(both(number));
            writer.written.recv().expect("written")
        });
        let frames: Vec<DepthFrame> =
            (0..FRAMES).map(|_| camera.frame(until(10.0)).expect("alive").expect("a frame")).collect();
        for (number, frame) in frames.iter().enumerate() {
            assert_eq!(numbers(frame), [number, number]);
        }
        let stamped: Vec<HostTime> = frames.iter().map(|frame| frame.host).collect();
        delays("one pipe", &written, &stamped);
        writer.close();
        assert!(matches!(died(&mut *camera).0, DeviceError::Lost { .. }));
    });
}

/// What was written before the start is not passed on, however long nobody fetched it.
#[test]
fn pictures_from_before_the_start_are_stale() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let (source, writer) = stacked(folder.path());
        let mut camera = open_video(&VideoOptions::new(source, SIZE, RATE_HZ)).expect("open");
        let interval = Duration::from_secs_f64(1.0 / RATE_HZ);
        for number in 1..20 {
            writer.tell(both(number));
            thread::sleep(interval);
        }
        camera.start().expect("started");
        for number in 20..30 {
            writer.tell(both(number));
            thread::sleep(interval);
        }
        let first = camera.frame(until(10.0)).expect("alive").expect("a frame");
        assert_eq!(numbers(&first), [20, 20]);
        assert!(camera.losses().stale >= 15, "{:?}", camera.losses());
        writer.close();
    });
}

#[test]
fn pipes_of_the_wrong_size_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (source, writer) = stacked(folder.path());
    let options = VideoOptions::new(source, [SIZE[0], SIZE[1] - 1], RATE_HZ);
    let error = open_video(&options).err().expect("refused").to_string();
    assert!(error.contains("gives 8 bits in 1 channel, 640 × 1440; expected"), "{error}");
    writer.close();
}

/// OpenCV 4.6 reads past the end of what is too short; this program would not live to tell.
#[test]
fn a_writer_that_dies_within_a_frame_is_a_lost_camera() {
    let folder = tempfile::tempdir().expect("a folder");
    let paths = [pipe(folder.path(), "grey"), pipe(folder.path(), "depth")];
    let source = VideoSource::pipes(&paths[0], &paths[1], SIZE, RATE_HZ);
    let writers = paths.map(Writer::new);
    writers[0].tell(grey(0));
    writers[1].tell(depth(0));
    let mut camera = started(source);
    writers[0].tell(grey(1)[..pixels() / 3].to_vec());
    writers[1].tell(depth(1)[..pixels() / 3].to_vec());
    for writer in writers {
        writer.written.recv().expect("written");
        writer.written.recv().expect("written");
        writer.close();
    }
    assert!(matches!(died(&mut *camera).0, DeviceError::Lost { .. }));
    assert_eq!(camera.losses().received, 0);
}

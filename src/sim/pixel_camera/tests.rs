//! Pictures of whole sessions: truth against markers, and the ways out.

use super::super::world::{Effect, Glimpse, Hold, Phantom, PhantomPlan, Press, Rig, Site, World};
use super::super::{Instruments, LiveBench, Slab};
use super::frame_pipe::FramePipe;
use super::*;
use crate::device::{Mounting, SensorMounting};
use crate::geometry::{Mat3, Vec3};
use crate::observation::Noise;
use crate::sim::pixels::{Camera, Channels, Depth, Frame, FrameFolder, Grey, Lens, PixelError, PixelSetup};
use std::fs::File;
use std::io::Read;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::channel;

const SIZE: [usize; 2] = [320, 240];

fn world() -> World {
    let quiet = Noise { force_n: [0.0; 3], torque_nm: [0.0; 3], marker_m: [0.0; 3], stage_m: [0.0; 3] };
    let inward = [0.0, 0.0, -1.0];
    World {
        name: "seen".to_owned(),
        seed: 5,
        phantom: PhantomPlan {
            seed: 3,
            slab: Slab { size_m: [0.06, 0.05, 0.02], glue_end_m: 0.025 },
            poisson_ratio: 0.47,
            sites: vec![Site { centre_m: [0.035, 0.025, 0.02], inward, radius_m: 0.006 }],
            patches: Vec::new(),
            spots: Vec::new(),
            marker_spacing_m: 0.009,
        },
        young_modulus_pa: 1e4,
        modulus_range_pa: [5e3, 2e4],
        stated_poisson_ratio: 0.47,
        holds: Vec::<Hold>::new(),
        pokes: vec![Press { site: 0, direction: inward, depth_m: 0.002, rate_m_s: 0.01, hold_s: 0.2 }],
        instruments: Instruments {
            noise: quiet,
            lost_share: 0.0,
            pause_s: 0.2,
            frame_rate_hz: 10.0,
            ..Instruments::default()
        },
        fit_cell_m: 0.0065,
        effects: Vec::new(),
    }
}

fn setup() -> PixelCameraSetup {
    let lens = Lens::undistorted(1400.0, SIZE[0], SIZE[1]);
    let (eye, target) = (Vec3::new(0.10, 0.02, 0.40), Vec3::new(0.03, 0.025, 0.02));
    let pixels = PixelSetup::new(Camera::looking_at(lens, SIZE, eye, target, -Vec3::x()), 11);
    PixelCameraSetup { dot_radius_m: 0.001, ..PixelCameraSetup::new(pixels, 10.0) }
}

fn phantom() -> &'static Phantom {
    static PHANTOM: OnceLock<Phantom> = OnceLock::new();
    PHANTOM.get_or_init(|| Phantom::prepare_seen(&world().phantom, &setup().cut).expect("a phantom"))
}

/// A bench whose stage stands 1 mm in the phantom at its site from the beginning.
fn bench() -> LiveBench {
    let mounting = Mounting::new([0.035, 0.025, 0.019], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4);
    let sensor = SensorMounting { to_phantom: Mat3::identity(), tip_m: Vec3::zeros(), reads_reaction: false };
    LiveBench::seen(world(), mounting.expect("two axes"), sensor, 0.0, &setup().cut).expect("a bench")
}

/// Every dot's true place is that of the marker of its number, at every time, to the 0.01 mm of the surface between its vertices.
#[test]
fn the_truth_of_dots_is_that_of_markers() -> Result<(), Box<dyn std::error::Error>> {
    let world = world();
    let past = world.happen(phantom())?;
    let recording = past.record()?;
    let mut camera = PixelCamera::of_past(&setup(), &past)?;
    let frames: Vec<Frame> = camera.film(&past).collect::<Result<_, _>>()?;
    assert_eq!(frames.len(), recording.markers.frame_time_s.len());
    let (mut compared, mut moved, mut hidden) = (0, 0.0_f64, 0);
    for (frame, &time_s) in frames.iter().zip(&recording.markers.frame_time_s) {
        assert!((frame.time_s - time_s).abs() < 1e-9 && frame.reported_s == frame.time_s);
        assert_eq!((frame.grey.width, frame.grey.height), (SIZE[0], SIZE[1]));
        for row in recording.markers.rows.iter().filter(|r| r.frame == frame.number) {
            let dot = &frame.dots[row.marker as usize];
            assert_eq!(dot.number, recording.markers.numbers[row.marker as usize]);
            let off = (dot.position_m - Vec3::from(row.position_m)).norm();
            let rest = Vec3::from(phantom().markers()[row.marker as usize]);
            let near = (rest - Vec3::from(world.phantom.sites[0].centre_m)).norm() < 0.007;
            assert!(off < if near { 4e-5 } else { 1e-5 }, "dot {} off by {off} m at {time_s} s", dot.number);
            moved = moved.max((dot.position_m - rest).norm());
            hidden += i32::from(dot.visible < 0.5);
            compared += 1;
        }
    }
    println!("{compared} dots compared, moved by {:.2} mm at most, {hidden} hidden", moved * 1e3);
    assert!(compared > 100 && moved > 3e-4);
    Ok(())
}

/// Numbered pictures and their times, as documented at the folder.
#[test]
fn a_session_goes_into_a_folder() -> Result<(), Box<dyn std::error::Error>> {
    let world = World { effects: vec![Effect::Rig(Rig::CameraLag { lag_s: 0.1 })], ..world() };
    let past = world.happen(phantom())?;
    let mut camera = PixelCamera::of_past(&setup(), &past)?;
    let folder = tempfile::tempdir()?;
    let mut files = FrameFolder::create(folder.path(), Channels::One)?;
    for frame in camera.film(&past).take(4) {
        let frame = frame?;
        assert!(FrameSink::deliver(&mut files, &frame, &AtomicBool::new(false))?);
        // Stamped with the time of the frame, showing what was 0.1 s before.
        assert!((frame.reported_s - 0.1 * f64::from(frame.number)).abs() < 0.1 + 1e-9);
        assert!((frame.reported_s - frame.time_s - 0.1).abs() < 1e-9);
    }
    files.finish()?;
    let depth = image::open(folder.path().join("depth-000003.png"))?.into_luma16();
    assert_eq!((depth.width(), depth.height()), (320, 240));
    // The camera is 0.39 m above the middle of the phantom's top, along a line that leans; depth is in tenths of a millimetre.
    let middle = depth.get_pixel(150, 110).0[0];
    assert!((3000..4000).contains(&middle), "{middle}");
    let times = std::fs::read_to_string(folder.path().join("frames.csv"))?;
    assert_eq!(times.lines().nth(4), Some("3,0.300000"));
    Ok(())
}

#[test]
fn a_world_without_skin_or_with_another_camera_is_refused() -> Result<(), Box<dyn std::error::Error>> {
    let world =
        World { effects: vec![Effect::Rig(Rig::CameraScale { scale: 1.1, depth_gain: 1.0 })], ..world() };
    let past = world.happen(phantom())?;
    let refused = PixelCamera::of_past(&setup(), &past).err();
    assert!(matches!(refused, Some(PixelError::NotInPictures { effect: "camera-scale" })), "{refused:?}");
    let past = World { effects: vec![], ..world.clone() };
    let past = past.happen(phantom())?;
    let never = PixelCameraSetup { rate_hz: 0.0, ..setup() };
    assert!(matches!(PixelCamera::of_past(&never, &past).err(), Some(PixelError::BadFigure { .. })));
    let mut camera = PixelCamera::of_past(&setup(), &past)?;
    let glimpse = past.glimpse(0.0, false).ok_or("no skin")?;
    let other = Glimpse { moved_m: vec![Vec3::zeros(); 3], ..glimpse };
    assert!(matches!(camera.frame(&other, 0), Err(PixelError::VertexCount { .. })));
    Ok(())
}

/// What comes out of the pipe is what was taken, for whoever reads first and for the next.
#[test]
fn a_live_camera_fills_a_pipe() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("camera");
    let bench = bench();
    // As the sensor's thread would do: the bench goes on because somebody feels it.
    bench.wrench(0.05)?;
    let setup = PixelCameraSetup { rate_hz: 200.0, ..setup() };
    let pixels = SIZE[0] * SIZE[1];
    let camera = PixelCamera::above(&setup, &bench)?;
    let (told, truth) = channel();
    let live = LiveCamera::start(camera, bench, FramePipe::create(&path, SIZE)?, move |frame| {
        // Whoever listens has heard enough when it is gone.
        let _ = told.send(frame.clone());
        Ok(())
    });
    let mut pipe = File::open(&path)?;
    for _ in 0..3 {
        let (mut grey, mut depth) = (vec![0; pixels], vec![0; 2 * pixels]);
        pipe.read_exact(&mut grey)?;
        pipe.read_exact(&mut depth)?;
        let frame = truth.recv()?;
        assert!(frame.grey.levels == grey, "frame {}", frame.number);
        let counts: Vec<u16> = depth.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        assert!(frame.depth.is_some_and(|d| d.counts == counts), "frame {}", frame.number);
        let lowest = frame.dots.iter().map(|d| d.position_m.z).fold(1.0, f64::min);
        assert!(lowest < 0.0199, "the tip is in: {lowest} m");
    }
    assert!(live.failure().is_none() && live.delivered() >= 3);
    drop(live);
    assert!(!path.exists());
    Ok(())
}

/// Where the reader goes, the stream ends; the next begins with a whole frame.
#[test]
fn the_next_reader_begins_with_a_whole_frame() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("camera");
    let never = AtomicBool::new(false);
    let mut pipe = FramePipe::create(&path, [8, 4])?;
    let frame = |level: u8| Frame {
        number: u32::from(level),
        time_s: 0.0,
        reported_s: 0.0,
        grey: Grey { width: 8, height: 4, levels: vec![level; 32] },
        depth: Some(Depth { width: 8, height: 4, unit_m: 1e-4, counts: vec![u16::from(level) << 8; 32] }),
        dots: Vec::new(),
    };
    assert!(!pipe.wanted()?);
    let open = || {
        let flags = rustix::fs::OFlags::RDONLY | rustix::fs::OFlags::NONBLOCK;
        rustix::fs::open(&path, flags, rustix::fs::Mode::empty()).map(File::from)
    };
    let mut first = open()?;
    assert!(pipe.wanted()? && pipe.deliver(&frame(1), &never)?);
    first.read_exact(&mut [0; 20])?;
    drop(first);
    assert!(!pipe.wanted()?);
    let mut next = open()?;
    assert!(pipe.wanted()? && pipe.deliver(&frame(2), &never)?);
    let mut whole = [0; 96];
    next.read_exact(&mut whole)?;
    assert!(whole[..32] == [2; 32] && whole[32..36] == [0, 2, 0, 2]);
    assert!(FramePipe::create(folder.path(), [8, 4]).is_err());
    Ok(())
}

/// A reader that does not read makes frames drop, not wait: what it gets once it reads is all that was made.
#[test]
fn what_nobody_reads_is_dropped_and_counted() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("camera");
    let bench = bench();
    let setup = PixelCameraSetup { rate_hz: 100.0, ..setup() };
    let camera = PixelCamera::above(&setup, &bench)?;
    let live = LiveCamera::start(camera, bench, FramePipe::create(&path, SIZE)?, |_| Ok(()));
    // Nobody looks: nothing is taken, nothing is lost.
    assert_eq!((live.delivered(), live.dropped()), (0, 0));
    let mut pipe = File::open(&path)?;
    // Fewer than two frames fit into the pipe; the next is stuck in the writer until the first is read.
    while live.delivered() == 0 {
        std::thread::yield_now();
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(live.delivered() <= 2, "{}", live.delivered());
    for _ in 0..live.delivered() + 2 {
        pipe.read_exact(&mut vec![0; 3 * SIZE[0] * SIZE[1]])?;
    }
    while live.dropped() == 0 {
        std::thread::yield_now();
    }
    assert!(live.failure().is_none());
    Ok(())
}

/// How much of a core a camera of 640 × 480 takes above the phantom of `rigs/sim.toml`. Told, not judged: it depends on who else is at the
/// machine. Run with `cargo test --release --lib what_pictures_cost -- --ignored --nocapture`.
#[test]
#[ignore = "prints how long pictures take"]
fn what_pictures_cost() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = world();
    world.phantom.slab = Slab { size_m: [0.10, 0.15, 0.025], glue_end_m: 0.037 };
    world.phantom.marker_spacing_m = 0.011;
    let site = |x, y| Site { centre_m: [x, y, 0.025], inward: [0.0, 0.0, -1.0], radius_m: 0.008 };
    world.phantom.sites =
        vec![site(0.05, 0.075), site(0.03, 0.04), site(0.075, 0.11), site(0.06, 0.03), site(0.03, 0.11)];
    world.pokes[0].depth_m = 0.003;
    let size = [640, 480];
    let lens =
        Lens { radial: [-0.09, 0.12, 0.0], tangential: [4e-4, -3e-4], ..Lens::undistorted(1620.0, 640, 480) };
    let (eye, target) = (Vec3::new(0.19, 0.075, 0.48), Vec3::new(0.05, 0.075, 0.02));
    let setup = PixelCameraSetup::new(
        PixelSetup::new(Camera::looking_at(lens, size, eye, target, -Vec3::x()), 7),
        30.0,
    );
    let cpu_ms = || {
        let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        t.tv_sec as f64 * 1e3 + t.tv_nsec as f64 * 1e-6
    };
    let start = cpu_ms();
    let bare = Phantom::prepare(&world.phantom)?;
    let without = cpu_ms() - start;
    let phantom = Phantom::prepare_seen(&world.phantom, &setup.cut)?;
    println!("prepared in {without:.0} ms, with a skin in {:.0} ms", cpu_ms() - start - without);
    drop(bare);
    let past = world.happen(&phantom)?;
    let mut camera = PixelCamera::of_past(&setup, &past)?;
    let vertices = phantom.skin().map_or(0, |s| s.points_m.len());
    println!("{vertices} vertices, {} dots", phantom.markers().len());
    // Where nothing has moved nothing is drawn anew.
    for (name, from_s, step_s) in
        [("nothing moves", 0.0, 0.0), ("tip in the air", 0.0, 0.002), ("tip goes in", 0.3, 0.003)]
    {
        let (mut took, mut look) = (Vec::new(), 0.0);
        for number in 0..60 {
            let start = cpu_ms();
            let glimpse = past.glimpse(from_s + step_s * f64::from(number), false).ok_or("no skin")?;
            look += cpu_ms() - start;
            let frame = camera.frame(&glimpse, number)?;
            took.push(cpu_ms() - start);
            assert_eq!(frame.grey.levels.len(), 640 * 480);
            camera.take_back(frame);
        }
        took.sort_by(f64::total_cmp);
        let (least, middle) = (took[0], took[30]);
        println!(
            "{name}: {least:.1} ms at best, {middle:.1} ms in the middle, {:.2} ms of it to look; {:.0} % and {:.0} % of a core at 30 Hz",
            look / 60.0,
            3.0 * least,
            3.0 * middle
        );
    }
    Ok(())
}

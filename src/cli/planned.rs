//! A protocol and a rig file → a plan, and the bench that it was made for.

use super::{StagedFile, UsageError};
use crate::acquire::{
    Action, Bench, Latency, ListedPoke, LoadLimits, PhantomBox, Plan, PlannedStep, Profile, Protocol, Stream,
    from_poke, pad_stiffness_n_per_m,
};
use crate::dataset::{read_phantom, read_planned_pokes};
use crate::geometry::Vec3;
use crate::mesh::TetMesh;
use crate::observation::PlannedPoke;
use crate::rig::RigFile;
use crate::session::{HashedText, Session};
use anyhow::Context as _;
use clap::Args;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// A protocol on a rig.
#[derive(Debug, Args)]
pub(super) struct PlannedArguments {
    /// The protocol: a TOML file, or a table of pokes as `diagnose` writes it (.csv)
    #[arg(value_name = "PROTOCOL")]
    protocol: PathBuf,
    /// The rig file
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// Give a variable of the protocol another value
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Begin with this poke
    #[arg(long, value_name = "POKE")]
    from: Option<u32>,
}

/// What is going to be done, where.
pub(super) struct Planned {
    pub(super) rig: RigFile,
    pub(super) bench: Bench,
    pub(super) protocol: Protocol,
    pub(super) protocol_text: String,
    pub(super) steps: Vec<PlannedStep>,
    pub(super) first_poke: u32,
}

/// Highest modulus over which no estimate is needed where a phantom is too thin for one: stiffness range per modulus range.
const THIN: f64 = 4.0;

impl PlannedArguments {
    /// A protocol on a rig, as both stand.
    pub(super) fn of_files(protocol: &Path, rig: &Path) -> Self {
        Self { protocol: protocol.to_owned(), rig: rig.to_owned(), set: Vec::new(), from: None }
    }

    /// Reads both files.
    pub(super) fn read(&self) -> anyhow::Result<Planned> {
        let rig = RigFile::read(&self.rig)?;
        let bench = bench(&rig)?;
        let (protocol, protocol_text) = self.protocol(&rig)?;
        let steps = protocol.expand();
        let steps = match self.from {
            Some(poke) => from_poke(&steps, poke)?.to_vec(),
            None => steps,
        };
        Ok(Planned { rig, bench, protocol, protocol_text, steps, first_poke: self.from.unwrap_or(1) })
    }

    fn protocol(&self, rig: &RigFile) -> anyhow::Result<(Protocol, String)> {
        let overrides = self.set.iter().map(|s| assignment(s)).collect::<Result<Vec<_>, _>>()?;
        let name = self.protocol.display().to_string();
        if self.protocol.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let pokes = read_planned_pokes(&self.protocol)?;
            let title =
                self.protocol.file_stem().map_or_else(|| name.clone(), |s| s.to_string_lossy().into_owned());
            let protocol = of_pokes(&name, &title, &pokes, rig.rest_s())?;
            let text =
                std::fs::read_to_string(&self.protocol).with_context(|| format!("{name}: can't be read"))?;
            return Ok((protocol, text));
        }
        let text =
            std::fs::read_to_string(&self.protocol).with_context(|| format!("{name}: can't be read"))?;
        Ok((Protocol::parse(&name, &text, &overrides)?, text))
    }
}

impl Planned {
    /// Pokes on a rig. `source` is what refusals call their table; what a session keeps of it is not known yet.
    pub(super) fn of_pokes(
        source: &Path,
        title: &str,
        pokes: &[PlannedPoke],
        rig: RigFile,
    ) -> anyhow::Result<Self> {
        let bench = bench(&rig)?;
        let protocol = of_pokes(&source.display().to_string(), title, pokes, rig.rest_s())?;
        let steps = protocol.expand();
        Ok(Self { rig, bench, protocol, protocol_text: String::new(), steps, first_poke: 1 })
    }

    /// The plan from where the stage is.
    pub(super) fn plan(&self, start_m: [f64; 2]) -> Plan {
        Plan::new(self.protocol.name(), &self.steps, &self.bench, start_m)
    }

    /// The pokes that touch the phantom: what a simulated bench has to be ready for.
    pub(super) fn pokes(&self) -> Vec<PlannedPoke> {
        let strokes = self.steps.iter().filter_map(|step| match &step.action {
            Action::Stroke { site_m, stroke } if !stroke.air => Some((site_m, stroke)),
            _ => None,
        });
        strokes
            .map(|(site_m, stroke)| {
                let hold_s = match stroke.profile {
                    Profile::Press { hold_s, .. } => hold_s,
                    Profile::Cycles { .. } => 0.0,
                };
                PlannedPoke {
                    site: Vec3::from(*site_m),
                    direction: stroke.direction.map_or_else(|| self.bench.tip_axis(), Vec3::from),
                    radius_m: self.bench.tip_radius_m,
                    depth_m: stroke.deepest_m(),
                    rate_m_s: stroke.speed_m_s,
                    hold_s,
                }
            })
            .collect()
    }

    /// Leaves out everything before a poke.
    pub(super) fn go_on_from(&mut self, poke: u32) -> anyhow::Result<()> {
        self.steps = from_poke(&self.protocol.expand(), poke)?.to_vec();
        self.first_poke = poke;
        Ok(())
    }

    /// The phantom's mesh; none where it is simulated.
    pub(super) fn mesh(&self) -> anyhow::Result<Option<TetMesh>> {
        let file = self.rig.mesh();
        let read = file.map(|file| {
            let to_do = if file.exists() { "" } else { "; `phantom-rig mesh block` makes one" };
            let mesh = read_phantom(&file).with_context(|| format!("the phantom's mesh{to_do}"))?;
            self.rig.holds(&mesh).with_context(|| file.display().to_string())?;
            Ok(mesh)
        });
        read.transpose()
    }

    /// That these pokes will give no markers, and what to do about it; nothing where they will.
    pub(super) fn unplaced(&self) -> anyhow::Result<Option<&'static str>> {
        if self.pokes().is_empty() {
            return Ok(None);
        }
        if !self.rig.records_markers() {
            return Ok(Some(
                "the rig file has no section [markers]: nobody looks at these pokes; rigs/sim-camera.toml shows that of a camera",
            ));
        }
        Ok(match self.rig.camera_is_known()? {
            Some([false, _]) => Some(
                "the rig file says nothing of the camera's lens: the pictures of these pokes will give no markers; \
                 `phantom-rig calibrate camera` makes a lens for it",
            ),
            Some([true, false]) => Some(
                "the rig file does not say where the camera stands: the pictures of these pokes give no markers until \
                 `phantom-rig calibrate registration` has found it out; `session export --registration` takes it then",
            ),
            Some([true, true]) | None => None,
        })
    }

    /// What a session keeps of the rig file.
    pub(super) fn rig_text(&self) -> HashedText {
        HashedText::new(self.rig.public_text())
    }

    /// Variables of the protocol that were given other values.
    pub(super) fn overridden(&self) -> BTreeMap<String, f64> {
        let given = self.protocol.variables().iter().filter(|v| v.overridden);
        given.map(|v| (v.name.clone(), v.value)).collect()
    }

    /// Refuses a session that was not begun with this protocol on this rig.
    pub(super) fn same_as(&self, session: &Session) -> anyhow::Result<()> {
        let protocol = HashedText::new(self.protocol_text.clone());
        Ok(session.begun_with(self.protocol.name(), &self.rig_text(), &protocol, &self.overridden())?)
    }

    /// Whether a step waits for a person.
    pub(super) fn asks(&self) -> bool {
        self.steps.iter().any(|step| matches!(step.action, Action::Ask { .. }))
    }
}

/// A protocol of pokes that somebody else has chosen.
fn of_pokes(source: &str, title: &str, pokes: &[PlannedPoke], pause_s: f64) -> anyhow::Result<Protocol> {
    let listed: Vec<_> = pokes
        .iter()
        .map(|poke| ListedPoke {
            site_m: poke.site.into(),
            direction: poke.direction.into(),
            radius_m: poke.radius_m,
            depth_m: poke.depth_m,
            rate_m_s: poke.rate_m_s,
            hold_s: poke.hold_s,
        })
        .collect();
    Ok(Protocol::of_pokes(source, title, &listed, pause_s)?)
}

/// `name=value`.
fn assignment(text: &str) -> Result<(String, f64), UsageError> {
    let parts =
        text.split_once('=').and_then(|(name, value)| Some((name.trim(), value.trim().parse().ok()?)));
    parts
        .map(|(name, value)| (name.to_owned(), value))
        .ok_or_else(|| UsageError(format!("--set takes NAME=VALUE with a number, got {text}")))
}

/// The bench of a rig file, as a plan sees it.
fn bench(rig: &RigFile) -> anyhow::Result<Bench> {
    let [travel_speed_m_s, approach_speed_m_s, acceleration_m_s2, stop_deceleration_m_s2] = rig.speeds();
    let [clearance_m, run_up_m, surface_tolerance_m] = rig.heights_m();
    let [sensor_s, serial_s] = rig.latencies_s();
    let (force_n, torque_nm) = rig.force_limits();
    let [low_m, high_m] = rig.phantom_box();
    let (poisson_ratio, _, modulus_range_pa) = rig.phantom();
    let (tip_radius_m, _, _) = rig.tip();
    let thickness_m = (0..3).map(|a| high_m[a] - low_m[a]).fold(f64::INFINITY, f64::min);
    let half_space = pad_stiffness_n_per_m(modulus_range_pa, poisson_ratio, tip_radius_m, 1e3 * tip_radius_m);
    let stiffness_n_per_m = pad_stiffness_n_per_m(modulus_range_pa, poisson_ratio, tip_radius_m, thickness_m)
        .or(half_space.map(|[low, high]| [low, THIN * high]))
        .with_context(|| format!("{}: the tip's radius gives no stiffness", rig.name()))?;
    Ok(Bench {
        limits: rig.limits(),
        mounting: rig.mounting(),
        tip_radius_m,
        phantom: PhantomBox { low_m, high_m },
        surface_tolerance_m,
        clearance_m,
        run_up_m,
        travel_speed_m_s,
        approach_speed_m_s,
        acceleration_m_s2,
        stop_deceleration_m_s2,
        latency: Latency { sensor_s, host_s: HOST_S, serial_s },
        load: LoadLimits { sensor: rig.sensor(), force_n, torque_nm, range: rig.force_range() },
        stiffness_n_per_m,
        least_rest_s: rig.rest_s(),
        streams: streams(rig),
    })
}

/// From a datagram's arrival to the stop on its way (s); 99 of 100 stops on the simulated bench take less (`benches/abort.rs`).
const HOST_S: f64 = 0.005;

/// What is recorded all the time, as it is stored.
fn streams(rig: &RigFile) -> Vec<Stream> {
    use crate::session::{Rates, bytes_per_second};
    let rate = |name, rate_hz: f64, rates: Rates| Stream {
        name,
        rate_hz,
        bytes: (bytes_per_second(rates) - bytes_per_second(Rates::default())) / rate_hz,
    };
    let none = Rates::default();
    let (force_hz, stage_hz) = (rig.force_rate_hz(), rig.stage_rate_hz());
    let frames_hz = rig.pictures().map_or(FRAMES_HZ, |(_, rate_hz)| rate_hz);
    let mut streams = vec![
        rate("force", force_hz, Rates { force_hz, ..none }),
        rate("stage", stage_hz, Rates { stage_hz, ..none }),
    ];
    if rig.records_markers() {
        streams.push(rate("markers", frames_hz, Rates { frames_hz, markers: MARKERS, ..none }));
    }
    if let Some((pixels, rate_hz)) = rig.pictures() {
        streams.push(Stream { name: "pictures", rate_hz, bytes: pixels as f64 * BYTES_PER_PIXEL });
    }
    streams
}

/// What a pixel of grey and 16-bit depth takes as PNG (bytes): 1.09 and 1.10 in two runs of `rigs/sim-camera.toml`. Noisier pictures take more,
/// up to 3.
const BYTES_PER_PIXEL: f64 = 1.1;

/// Frames of markers a second without a camera, and markers in a frame: what room on the disk is reckoned with.
const FRAMES_HZ: f64 = 30.0;
const MARKERS: u32 = 150;

/// Draws a plan into a file.
pub(super) fn draw(plan: &Plan, bench: &Bench, file: &Path, force: bool) -> anyhow::Result<()> {
    let staged = StagedFile::new(file, force || is_drawing(file))?;
    std::fs::write(staged.path(), plan.drawing(bench))
        .with_context(|| format!("{}: can't be written", file.display()))?;
    Ok(staged.finish()?)
}

/// Whether a file is the drawing of a plan, which can be made again. Its beginning tells.
fn is_drawing(file: &Path) -> bool {
    let mut beginning = Vec::new();
    let read = File::open(file).and_then(|file| file.take(1024).read_to_end(&mut beginning));
    read.is_ok() && Plan::is_drawing(&beginning)
}

//! A whole run: zero, homing, the steps of the plan, and what is done when it has to stop.

use super::event::{clock_probe, event, leg as leg_begins, step as step_begins};
use super::frames::fetch;
use super::pilot::{Halted, Pilot, Shared, UntilForce};
use super::zero::{Zero, zero};
use crate::acquire::AcquireError;
use crate::acquire::guard::{Limits, watch};
use crate::acquire::latch::{Cause, Latch, StopOnPanic, Tripped};
use crate::acquire::live::LiveForce;
use crate::acquire::operator::Operator;
use crate::acquire::plan::{Bench, CheckedPlan, Leg, Phase, Plan, PlanStep};
use crate::acquire::protocol::{Action, Profile, Target};
use crate::acquire::status::{Doing, Watched};
use crate::clock::HostTime;
use crate::device::{
    AXES, DeviceError, ForceSensor, Losses, MarkerSource, Motion, Stage, StageReport, with_causes,
};
use crate::geometry::Vec3;
use crate::session::{Recorder, SessionWriter};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A stage that was stopped stands within this time.
const STANDS: Duration = Duration::from_secs(2);
/// What is recorded after a stop.
const AFTERMATH: Duration = Duration::from_millis(300);
/// So often a zero is tried where the sensor does not rest.
const ZEROS: usize = 3;
/// A height is the clearance within this (m).
const AGREED_M: f64 = 5e-5;
/// A stage that stands says so within this time.
const READY: Duration = Duration::from_secs(2);

/// The devices.
pub struct Instruments<'a> {
    /// The stage.
    pub stage: &'a mut dyn Stage,
    /// The force sensor, started.
    pub force: &'a mut dyn ForceSensor,
    /// Where marker positions come from, if anything tells them.
    pub markers: Option<&'a mut dyn MarkerSource>,
}

/// Makes the plan from where the stage stands.
pub type Planner<'a> = dyn Fn([f64; AXES]) -> Result<CheckedPlan, AcquireError> + Sync + 'a;

/// What is to be done, and who watches.
pub struct Conduct<'a> {
    /// Makes the plan, once it is known where the stage stands.
    pub plan: &'a Planner<'a>,
    /// The bench that it was made for.
    pub bench: &'a Bench,
    /// Longest silence of the sensor.
    pub silence: Duration,
    /// Most records in a row that may be lost.
    pub gap: u32,
    /// Most records in a row with the sensor's clock standing.
    pub frozen: u32,
    /// What stops the run.
    pub latch: &'a Latch,
    /// Where it is told how the run goes.
    pub watched: &'a Watched,
    /// Who answers questions.
    pub operator: &'a Operator,
}

/// How a run ended.
#[derive(Debug, Default)]
pub struct Ran {
    /// Why it was stopped; none when the plan was carried out to its end.
    pub stopped: Option<Stopped>,
    /// Whether a person asked for a stop, also when something else had stopped it before.
    pub asked: bool,
    /// What became of the force records.
    pub losses: Losses,
    /// The zero in use, once it was taken.
    pub zero: Option<Zero>,
    /// The plan; none where the run was stopped before there could be one.
    pub plan: Option<CheckedPlan>,
    /// Steps of the plan that were carried out.
    pub steps: usize,
    /// What a device said when it failed.
    pub failure: Option<DeviceError>,
    /// What the device that caused the stop says of it, where that is more than the cause itself.
    pub why: Option<String>,
}

/// What is known of a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopped {
    /// Why, and when.
    pub tripped: Tripped,
    /// How far the stage went on after its last report before that (m).
    pub overshoot_m: f64,
    /// Largest force from then on, reading less zero (N).
    pub peak_n: f64,
    /// Whether the stage was seen to stand.
    pub stands: bool,
    /// Whether the tip was taken out of the phantom.
    pub retracted: bool,
}

/// Makes the stage ready (homed, clear of the phantom), plans from where it stands, and carries the plan out. Everything is recorded through
/// `writer`, which the caller finishes.
///
/// # Errors
/// [`AcquireError`]: the sensor gives no zero that limits can count from, or something speaks against the plan. The phantom was not
/// touched then. Whatever happens later ends the run and is told in [`Ran`].
pub fn conduct(
    instruments: Instruments<'_>,
    conduct: &Conduct<'_>,
    writer: &SessionWriter,
) -> Result<Ran, AcquireError> {
    let Instruments { stage, force, markers } = instruments;
    let mut recorder = writer.recorder();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let _stop = StopOnPanic(conduct.latch);
        // Also when this thread panics: nobody else ends those that it has started.
        let is_over = Over(&over);
        let frames = markers.map(|source| {
            let recorder = writer.recorder();
            let (latch, watched, over) = (conduct.latch, conduct.watched, &over);
            scope.spawn(move || fetch(source, recorder, latch, watched, over))
        });
        let mut ran = led(stage, force, conduct, writer, &mut recorder);
        drop(is_over);
        let failed = frames.and_then(|thread| thread.join().ok()?.err());
        if let (Ok(ran), Some(error)) = (&mut ran, failed) {
            recorder.event(event("camera-lost", None, json!({"why": with_causes(&error)})));
            if ran.stopped.is_some_and(|s| s.tripped.cause == Cause::CameraLost) {
                ran.failure.get_or_insert(error);
            }
        }
        for (device, counts) in [("stage", stage.line_counts()), ("force", force.line_counts())] {
            if !counts.is_empty() {
                let counts: BTreeMap<_, _> = counts.into_iter().collect();
                recorder.event(event("line", None, json!({"device": device, "counts": counts})));
            }
        }
        ran
    })
}

/// Says that it is over when it is dropped.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// The stage made ready, the zero taken, then the plan.
fn led(
    stage: &mut dyn Stage,
    force: &mut dyn ForceSensor,
    conduct: &Conduct<'_>,
    writer: &SessionWriter,
    recorder: &mut Recorder,
) -> Result<Ran, AcquireError> {
    let mut ran = Ran::default();
    if let Some(compared) = force.clock_at_start() {
        recorder.clock_probe(clock_probe("force", compared));
    }
    let report = stage.report(HostTime::now() + READY).ok().flatten();
    let homed = report.filter(|r| r.homed);
    let out = homed.and_then(|r| way_out(conduct.bench, r, None));
    if homed.is_none() || out.is_some() {
        // Until the stage stands clear of the phantom, the limits count from what the sensor reads now.
        tell(conduct, Doing::Zeroing);
        let first = zeroed(force, conduct, writer, recorder)?;
        guarded(stage, force, conduct, writer, recorder, first, &mut ran, |pilot, _| match out {
            Some(motion) => {
                pilot.begin(Doing::Retracting, 5.0, 0.0);
                pilot.note(event("lifting", None, json!({"target_m": motion.target_m})));
                pilot.go(motion, None).map(|_| ())
            }
            None => {
                pilot.begin(Doing::Homing, 30.0, 0.0);
                pilot.note(event("homing", None, json!({})));
                pilot.home()
            }
        });
        if ran.stopped.is_some() {
            return Ok(ran);
        }
    }
    tell(conduct, Doing::Zeroing);
    let zero = zeroed(force, conduct, writer, recorder)?;
    let stands =
        stage.report(HostTime::now() + READY)?.ok_or(AcquireError::StageSaysNothing { waited: READY })?;
    let checked = (conduct.plan)(stands.position_m)?;
    let plan = checked.plan();
    conduct.watched.tell(|status| status.pokes = plan.last_poke());
    guarded(stage, force, conduct, writer, recorder, zero, &mut ran, |pilot, steps| {
        pilot.has_planned(Duration::from_secs_f64(plan.duration_s));
        for step in &plan.steps {
            pilot.note(step_begins(step));
            carry_out(pilot, step, plan, conduct)?;
            *steps += 1;
        }
        Ok(())
    });
    ran.plan = Some(checked);
    tell(conduct, Doing::Done);
    Ok(ran)
}

fn tell(conduct: &Conduct<'_>, doing: Doing) {
    conduct.watched.tell(|status| status.doing = doing);
}

/// The zero, put down. Refuses one from which a limit lies beyond what the sensor can read.
fn zeroed(
    force: &mut dyn ForceSensor,
    conduct: &Conduct<'_>,
    writer: &SessionWriter,
    recorder: &mut Recorder,
) -> Result<Zero, AcquireError> {
    let mut own = writer.recorder();
    let load = &conduct.bench.load;
    let scale = force.format().scale();
    let limits = std::array::from_fn(|a| scale[a] * if a < 3 { load.force_n[a] } else { load.torque_nm });
    let mut left = ZEROS;
    let zero = loop {
        let zero = zero(force, |records| {
            own.force(records, HostTime::now());
        })?;
        left -= 1;
        match zero.restless(limits) {
            None => break zero,
            Some(axis) if left == 0 => {
                return Err(AcquireError::NotAtRest { axis, moved: zero.moved[axis] / scale[axis] });
            }
            Some(_) => {}
        }
    };
    recorder.event(event(
        "zero",
        None,
        json!({"mean_counts": zero.mean, "sd_counts": zero.sd, "moved_counts": zero.moved, "records": zero.records}),
    ));
    let reads = force.format().wrench(zero.mean.map(|c| c.round() as i32));
    for (axis, reads) in reads.into_iter().enumerate() {
        let (limit, range) = (if axis < 3 { load.force_n[axis] } else { load.torque_nm }, load.range[axis]);
        if reads.abs() + limit > range {
            return Err(AcquireError::LimitOutOfRange { axis, reads, limit, range });
        }
    }
    Ok(zero)
}

/// Does something with the stage while the force is watched, and what has to be done when that ends in a stop.
#[expect(clippy::too_many_arguments, reason = "one thread's worth of devices and what they share")]
fn guarded(
    stage: &mut dyn Stage,
    force: &mut dyn ForceSensor,
    conduct: &Conduct<'_>,
    writer: &SessionWriter,
    recorder: &mut Recorder,
    zero: Zero,
    ran: &mut Ran,
    body: impl FnOnce(&mut Pilot<'_>, &mut usize) -> Result<(), Halted>,
) {
    let load = &conduct.bench.load;
    let limits = Limits {
        wrench: std::array::from_fn(|i| if i < 3 { load.force_n[i] } else { load.torque_nm }),
        zero: zero.mean,
        silence: conduct.silence,
        age: conduct.silence.max(Duration::from_secs_f64(conduct.bench.latency.sensor_s)),
        gap: conduct.gap,
        frozen: conduct.frozen,
    };
    let live = LiveForce::new(zero.mean.map(|c| c.round() as i32), force.format().rate_hz);
    let over = AtomicBool::new(false);
    let health = writer.health();
    let shared = Shared {
        latch: conduct.latch,
        live: &live,
        watched: conduct.watched,
        operator: conduct.operator,
        health: &health,
        sensor: load.sensor,
        format: *force.format(),
        started: HostTime::now(),
    };
    ran.zero = Some(zero);
    std::thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            let mut own = writer.recorder();
            let watched = watch(force, limits, conduct.latch, &live, &over, |records| {
                own.force(records, HostTime::now());
            });
            let losses = force.losses();
            conduct.watched.tell(|status| status.losses = losses);
            (watched, losses)
        });
        let mut pilot = Pilot::new(stage, recorder, shared);
        let _stop = StopOnPanic(conduct.latch);
        let finished = Over(&over);
        // Whoever halts the pilot has tripped the latch.
        let _ = body(&mut pilot, &mut ran.steps);
        if let Some(tripped) = conduct.latch.tripped() {
            ran.stopped = Some(aftermath(&mut pilot, tripped, conduct, &live, &shared));
        }
        ran.failure = pilot.into_failure();
        drop(finished);
        if let Ok((watched, losses)) = watcher.join() {
            ran.losses = losses;
            if let Err(error) = watched {
                ran.failure.get_or_insert(error);
            }
        }
    });
    ran.why = match ran.stopped.map(|stopped| stopped.tripped.cause) {
        Some(Cause::SensorSilent { .. }) => force.why_silent(),
        Some(Cause::SensorStatus { status }) => Some(force.explain(status).join(", ")),
        Some(Cause::StageFault { code }) => Some(stage.meaning(code)),
        _ => None,
    };
    if let Some(why) = &ran.why {
        recorder.event(event("why", None, json!({"why": why})));
    }
    ran.asked = conduct.latch.was_asked();
    // A stop in the very last moment still is one.
    if ran.stopped.is_none() {
        ran.stopped = conduct.latch.tripped().map(|tripped| Stopped {
            tripped,
            overshoot_m: 0.0,
            peak_n: 0.0,
            stands: false,
            retracted: false,
        });
    }
}

/// One step of the plan.
fn carry_out(
    pilot: &mut Pilot<'_>,
    step: &PlanStep,
    plan: &Plan,
    conduct: &Conduct<'_>,
) -> Result<(), Halted> {
    let total = plan.duration_s;
    match &step.step.action {
        Action::Mark { text } => pilot.note(event("mark", None, json!({"text": text}))),
        Action::Ask { text } => {
            pilot.begin(Doing::Asking, 0.0, total - step.start_s);
            pilot.ask(text)?;
            pilot.note(event("agreed", None, json!({"text": text})));
        }
        Action::Wait { .. } => {}
        Action::Stroke { site_m, stroke } => {
            let direction = direction(stroke.direction, conduct.bench);
            let radius_m = conduct.bench.tip_radius_m;
            let detail = json!({
                "site_m": site_m, "direction": <[f64; 3]>::from(direction), "radius_m": radius_m,
                "speed_m_s": stroke.speed_m_s, "air": stroke.air, "deepest_m": stroke.deepest_m(),
            });
            pilot.note(event("stroke", step.step.poke, detail));
            if let Some(poke) = step.step.poke {
                conduct.watched.tell(|status| status.poke = poke as usize);
            }
        }
    }
    let line = line(step, conduct.bench);
    for leg in &step.legs {
        pilot.on_line(line.filter(|_| leg.depth_m.is_some()));
        pilot.begin(Doing::Leg(leg.phase), leg.duration_s, total - leg.end_s());
        pilot.note(leg_begins(step, leg));
        match leg.motion {
            Some(motion) => {
                pilot.stands_at(leg.from_m)?;
                let until = until_force(step, leg, conduct.bench);
                if let Some(reached_n) = pilot.go(motion, until)? {
                    pilot.note(event("force-reached", step.step.poke, json!({"force_n": reached_n})));
                }
            }
            None => pilot.stay(HostTime::now() + Duration::from_secs_f64(leg.duration_s))?,
        }
    }
    pilot.on_line(None);
    if step.step.poke.is_some() {
        pilot.note(event("stroke-end", step.step.poke, json!({})));
    }
    Ok(())
}

/// The direction of a stroke in the phantom frame: straight in where nothing else is said.
fn direction(stated: Option<[f64; 3]>, bench: &Bench) -> Vec3 {
    stated.map_or_else(|| bench.tip_axis(), Vec3::from)
}

/// Where a stroke begins in stage coordinates, and its direction there.
fn line(step: &PlanStep, bench: &Bench) -> Option<([f64; AXES], [f64; AXES])> {
    let Action::Stroke { site_m, stroke } = &step.step.action else { return None };
    let site = bench.mounting.position_for(Vec3::from(*site_m)).ok()?;
    Some((site, bench.mounting.motion_for(direction(stroke.direction, bench))))
}

/// The force at which a leg ends, if it does.
fn until_force(step: &PlanStep, leg: &Leg, bench: &Bench) -> Option<UntilForce> {
    let Action::Stroke { stroke, .. } = &step.step.action else { return None };
    match stroke.profile {
        Profile::Press { target: Target::Force { force_n, .. }, .. } if leg.phase == Phase::Press => {
            Some(UntilForce { force_n, direction: direction(stroke.direction, bench) })
        }
        _ => None,
    }
}

/// After a stop: watches the stage until it stands, takes the tip out where that is safe, and puts all of it down.
fn aftermath(
    pilot: &mut Pilot<'_>,
    tripped: Tripped,
    conduct: &Conduct<'_>,
    live: &LiveForce,
    shared: &Shared<'_>,
) -> Stopped {
    tell(conduct, Doing::Stopped);
    conduct.watched.tell(|status| status.tripped = Some(tripped));
    let before = pilot.last_before(tripped.seen);
    let stands = pilot.watch_standing(STANDS);
    let after = pilot.last();
    let moved = |b: StageReport, a: StageReport| {
        (0..AXES).map(|i| (a.position_m[i] - b.position_m[i]).powi(2)).sum::<f64>().sqrt()
    };
    let overshoot_m = before.zip(after).map_or(0.0, |(b, a)| moved(b, a));
    let rests = HostTime::now() + AFTERMATH;
    while HostTime::now() < rests && pilot.watch_standing(AFTERMATH) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let peak = shared.format.wrench(live.farthest_after_stop());
    let peak_n = peak[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
    let sent_after_ns = tripped.sent.map(|sent| sent.since(tripped.seen).as_nanos() as u64);
    pilot.note(event("stopped", None, json!({
        "cause": tripped.cause.to_string(), "seen_host_ns": tripped.seen.nanos(), "stop_bytes_after_ns": sent_after_ns,
        "overshoot_m": overshoot_m, "peak_n": peak_n, "stands": stands,
    })));
    let retracted =
        stands && tripped.cause.may_retract() && after.is_some_and(|r| r.homed) && retract(pilot, conduct);
    Stopped { tripped, overshoot_m, peak_n, stands, retracted }
}

/// Takes the tip out of the phantom to above its surface.
fn retract(pilot: &mut Pilot<'_>, conduct: &Conduct<'_>) -> bool {
    let along = pilot.along();
    let Some(motion) = pilot.last().and_then(|report| way_out(conduct.bench, report, along)) else {
        return false;
    };
    if !conduct.latch.arm_again() {
        return false;
    }
    tell(conduct, Doing::Retracting);
    let done = pilot.retract(motion);
    // A person has to clear the stage before it moves again.
    conduct.latch.stop_again();
    let done = done.unwrap_or(false);
    pilot.note(event("retracted", None, json!({"done": done, "target_m": motion.target_m})));
    done
}

/// The motion that takes the tip above the phantom: back `along` the poke in progress, otherwise straight out, as far as the travel
/// allows. None where it is above already.
fn way_out(bench: &Bench, report: StageReport, along: Option<[f64; AXES]>) -> Option<Motion> {
    let height = bench.height_m(bench.mounting.tip_at(report.position_m));
    if height >= bench.clearance_m - AGREED_M {
        return None;
    }
    let straight = if bench.descends([0.0, 1.0]) > 0.0 { [0.0, 1.0] } else { [0.0, -1.0] };
    let along = along.unwrap_or(straight);
    let back = (bench.clearance_m - height) / bench.descends(along).max(0.1);
    let [low, high] = [0, 1].map(|end| bench.limits.travel_m.map(|t| t[end]));
    let target_m = std::array::from_fn(|a| (report.position_m[a] - along[a] * back).clamp(low[a], high[a]));
    let way_m = std::array::from_fn(|a| target_m[a] - report.position_m[a]);
    let speed_m_s = bench.allowed_m_s(way_m, bench.approach_speed_m_s);
    Some(Motion { target_m, speed_m_s, acceleration_m_s2: bench.acceleration_m_s2 })
}

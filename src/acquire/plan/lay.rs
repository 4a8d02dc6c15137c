//! Single steps → motions of the stage, one after the other.
//!
//! A poke: travel to above its site, rest, approach to the run-up, press at the poke's speed through the surface, hold, retreat to the
//! run-up, lift to the clearance. Between places the tip first rises to the clearance above the whole phantom, then goes aside, and
//! only then down again.

use super::bench::Bench;
use super::check;
use super::motions::{Contact, Leg, Phase, Plan, PlanStep};
use super::trapezoid::Trapezoid;
use super::violation::{At, Breach, Violation, add};
use crate::acquire::protocol::{Action, PlannedStep, Profile, Stroke, Target};
use crate::device::{AXES, Motion};
use crate::geometry::Vec3;

/// Directions lean from the face's normal by this cosine at least: 45°.
const STEEPEST: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Ways shorter than this are not made (m).
const NO_WAY_M: f64 = 1e-6;

impl Plan {
    /// The plan for single steps of the protocol `name`, all of them or some in a row, the stage standing at `start_m`.
    pub fn new(name: &str, steps: &[PlannedStep], bench: &Bench, start_m: [f64; AXES]) -> Self {
        let mut violations = check::figures(bench, start_m);
        let sound = violations.is_empty();
        if sound {
            check::bench(bench, &mut violations);
        }
        let mut layer = Layer { bench, at_m: start_m, time_s: 0.0, legs: Vec::new() };
        let mut planned = Vec::with_capacity(steps.len());
        for step in steps {
            let start_s = layer.time_s;
            // Figures that make no sense make no motions.
            let contact = if sound { layer.step(step, &mut violations) } else { None };
            let duration_s = layer.time_s - start_s;
            let legs = std::mem::take(&mut layer.legs);
            planned.push(PlanStep { step: step.clone(), start_s, duration_s, legs, contact });
        }
        if sound {
            check::steps(&planned, bench, &mut violations);
        }
        Self {
            name: name.to_owned(),
            steps: planned,
            violations,
            duration_s: layer.time_s,
            streams: bench.streams.clone(),
        }
    }
}

/// Lays one leg after another.
struct Layer<'a> {
    bench: &'a Bench,
    at_m: [f64; AXES],
    time_s: f64,
    legs: Vec<Leg>,
}

/// The line of a stroke in stage coordinates: straight, from above the site to the deepest point.
struct Line {
    above_m: [f64; AXES],
    deepest_m: [f64; AXES],
    /// Depths there (m).
    depths_m: [f64; 2],
}

impl Line {
    fn at(&self, depth_m: f64) -> [f64; AXES] {
        let [above, deepest] = self.depths_m;
        let share = (depth_m - above) / (deepest - above);
        std::array::from_fn(|i| self.above_m[i] + share * (self.deepest_m[i] - self.above_m[i]))
    }
}

impl Layer<'_> {
    fn step(&mut self, step: &PlannedStep, violations: &mut Vec<Violation>) -> Option<Contact> {
        match &step.action {
            Action::Stroke { site_m, stroke } => {
                let laid = self.stroke(Vec3::from(*site_m), stroke);
                laid.unwrap_or_else(|breach| {
                    add(violations, Some(At::from(step)), breach);
                    None
                })
            }
            Action::Wait { duration_s } => {
                self.stand(Phase::Rest, *duration_s, None);
                None
            }
            Action::Mark { .. } | Action::Ask { .. } => None,
        }
    }

    fn stroke(&mut self, site: Vec3, stroke: &Stroke) -> Result<Option<Contact>, Breach> {
        let direction = stroke.direction.map_or_else(|| self.bench.tip_axis(), Vec3::from);
        let steep = direction.dot(&self.bench.face().inward);
        if steep < STEEPEST {
            let (lean_deg, most_deg) =
                (steep.clamp(-1.0, 1.0).acos().to_degrees(), STEEPEST.acos().to_degrees());
            return Err(Breach::Leaning { lean_deg, most_deg });
        }
        let reach = |depth_m: f64| {
            let position = self.bench.mounting.position_for(site + direction * depth_m);
            position.map_err(Breach::Unreachable)
        };
        reach(0.0)?;
        let deepest_m = stroke.deepest_m();
        let (above, run_up) = (-self.bench.clearance_m / steep, -self.bench.run_up_m / steep);
        let depths_m = [above, deepest_m];
        let line = Line { above_m: reach(above)?, deepest_m: reach(deepest_m)?, depths_m };
        let (speed, back) = (stroke.speed_m_s, stroke.retreat_speed_m_s);

        self.travel(line.above_m);
        self.stand(Phase::Rest, stroke.pause_s, None);
        let down = self.allowed_m_s(line.at(run_up), self.bench.approach_speed_m_s);
        self.along(Phase::Approach, &line, [above, run_up], down);
        let touches_s;
        let innermost_m;
        match stroke.profile {
            Profile::Press { target, hold_s } => {
                innermost_m = self.expected_depth_m(target);
                touches_s = self.press(&line, [run_up, innermost_m], speed, target);
                self.stand(Phase::Hold, hold_s, Some(innermost_m));
            }
            Profile::Cycles { offset_m, amplitude_m, count } => {
                let (near, far) = (offset_m - amplitude_m, offset_m + amplitude_m);
                innermost_m = near;
                touches_s = self.press(&line, [run_up, near], speed, Target::Depth { depth_m: near });
                for _ in 0..count {
                    self.along(Phase::Cycle, &line, [near, far], speed);
                    self.along(Phase::Cycle, &line, [far, near], speed);
                }
            }
        }
        let leaves_s = self.time_s + self.time_on([innermost_m, run_up], back, innermost_m);
        self.along(Phase::Retreat, &line, [innermost_m, run_up], back);
        self.travel_to(line.above_m);
        let contact = Contact {
            start_s: touches_s,
            end_s: leaves_s,
            depth_m: deepest_m,
            force_n: check::forces_n(self.bench, stroke),
            overshoot_m: self.bench.overshoot_m(speed),
            overshoot_n: self.bench.overshoot_m(speed) * self.bench.stiffness_n_per_m[1],
        };
        Ok((!stroke.air).then_some(contact))
    }

    /// Where a press is expected to end (m): for a force with the middle of the stiffness on a logarithmic scale.
    fn expected_depth_m(&self, target: Target) -> f64 {
        let [soft, stiff] = self.bench.stiffness_n_per_m;
        match target {
            Target::Depth { depth_m } => depth_m,
            Target::Force { force_n, depth_limit_m } => depth_limit_m.min(force_n / (soft * stiff).sqrt()),
        }
    }

    /// Presses in and says when the surface is touched (s). Until a force, the motion aims at the deepest point.
    fn press(&mut self, line: &Line, depths_m: [f64; 2], speed_m_s: f64, target: Target) -> f64 {
        let touches_s = self.time_s + self.time_on(depths_m, speed_m_s, -depths_m[0]);
        self.along(Phase::Press, line, depths_m, speed_m_s);
        if let (Target::Force { .. }, Some(Leg { motion: Some(motion), .. })) = (target, self.legs.last_mut())
        {
            motion.target_m = rounded(line.at(line.depths_m[1]));
        }
        touches_s
    }

    /// Time for a part of a way between two depths (s).
    fn time_on(&self, depths_m: [f64; 2], speed_m_s: f64, part_m: f64) -> f64 {
        let length_m = (depths_m[1] - depths_m[0]).abs();
        Trapezoid::new(length_m, speed_m_s, self.bench.acceleration_m_s2).time_at(part_m)
    }

    fn along(&mut self, phase: Phase, line: &Line, depths_m: [f64; 2], speed_m_s: f64) {
        self.go(phase, line.at(depths_m[1]), speed_m_s, Some(depths_m));
    }

    /// Up to the clearance above the phantom, aside, and down.
    fn travel(&mut self, to_m: [f64; AXES]) {
        for stop_m in [self.risen(self.at_m), self.risen(to_m), to_m] {
            self.travel_to(stop_m);
        }
    }

    fn travel_to(&mut self, to_m: [f64; AXES]) {
        let speed_m_s = self.allowed_m_s(to_m, self.bench.travel_speed_m_s);
        self.go(Phase::Travel, to_m, speed_m_s, None);
    }

    fn allowed_m_s(&self, to_m: [f64; AXES], most_m_s: f64) -> f64 {
        let target_m = rounded(to_m);
        self.bench.allowed_m_s(std::array::from_fn(|i| target_m[i] - self.at_m[i]), most_m_s)
    }

    /// A position with the second axis drawn back until the tip is at the clearance, if it is not.
    fn risen(&self, [first, second]: [f64; AXES]) -> [f64; AXES] {
        let height_m = self.bench.height_m(self.bench.mounting.tip_at([first, second]));
        let lacks_m = self.bench.clearance_m - height_m;
        if lacks_m <= NO_WAY_M {
            return [first, second];
        }
        [first, second - lacks_m / self.bench.descends([0.0, 1.0])]
    }

    /// Goes straight to a position at a speed in the phantom frame.
    fn go(&mut self, phase: Phase, to_m: [f64; AXES], speed_m_s: f64, depth_m: Option<[f64; 2]>) {
        let target_m = rounded(to_m);
        let way = std::array::from_fn(|i| target_m[i] - self.at_m[i]);
        let stage_m = f64::hypot(way[0], way[1]);
        if stage_m < NO_WAY_M {
            return;
        }
        let length_m = self.bench.mounting.moved_by(way).norm();
        // Axes that are not at right angles make a way longer or shorter to the stage than it is.
        let skew = stage_m / length_m;
        let skew = if (skew - 1.0).abs() < 1e-9 { 1.0 } else { skew };
        let acceleration = self.bench.acceleration_m_s2;
        let motion = Motion { target_m, speed_m_s: speed_m_s * skew, acceleration_m_s2: acceleration * skew };
        let duration_s = Trapezoid::new(length_m, speed_m_s, acceleration).duration_s();
        self.leg(phase, Some(motion), depth_m, duration_s);
        self.at_m = target_m;
    }

    fn stand(&mut self, phase: Phase, duration_s: f64, depth_m: Option<f64>) {
        if duration_s > 0.0 {
            self.leg(phase, None, depth_m.map(|depth| [depth; 2]), duration_s);
        }
    }

    fn leg(&mut self, phase: Phase, motion: Option<Motion>, depth_m: Option<[f64; 2]>, duration_s: f64) {
        let (from_m, start_s) = (self.at_m, self.time_s);
        self.legs.push(Leg { phase, from_m, motion, depth_m, start_s, duration_s });
        self.time_s += duration_s;
    }
}

/// To the nanometre, far below any stage's step: rounding must not carry a motion beyond its travel.
fn rounded(position_m: [f64; AXES]) -> [f64; AXES] {
    position_m.map(|p| (p * 1e9).round() * 1e-9)
}

//! What the calibration set of a session makes of readings and reports.
//!
//! - **Force.** A reading less its zero becomes the wrench on the tool by the sensor's correction C (`calib::instruments::force`), before the sensor's
//!   mounting turns it into the phantom frame. Where weights were hung along the phantom's axes, C contains that turn, and the mounting's is
//!   taken back.
//! - **Stage.** A displacement of the tip from the site of its poke becomes (1 + scale) times as long, along each axis. What backlash and scatter
//!   leave open goes into the stated noise of the stage. Why from the site and not from the stage's zero: where the surface is, was found with
//!   this stage; a stretch about its zero would shift every site by the scale times the way there, and make each poke deeper or shallower.

use crate::calib::Day;
use crate::calib::instruments::InstrumentError;
use crate::calib::instruments::force::{ForceFile, Frame};
use crate::calib::instruments::stage::StageFile;
use crate::calib::set::valid_days;
use crate::device::{AXES, Mounting, SensorMounting};
use crate::geometry::{Mat3, Vec3};
use crate::session::{CalibrationDocument, StartDocument};
use std::path::Path;

/// The calibration of one session.
#[derive(Debug, Clone, Default)]
pub(super) struct Calibrated {
    force: Option<ForceFile>,
    scale: [f64; AXES],
    /// Standard deviation that backlash and scatter leave of a place (m).
    pub(super) place_sd_m: f64,
    /// What was used, for people.
    pub(super) words: Vec<String>,
    /// Why it should not have been used, for people.
    pub(super) doubt: Option<String>,
}

/// That a session was not recorded on a day on which its calibration set holds; nothing where it was, or where nobody knows.
fn out_of_date(name: &str, set: &str, started_utc: &str) -> Option<String> {
    let [from, until] = valid_days(set)?;
    let recorded = Day::of_time(started_utc).ok()?;
    (!(from..=until).contains(&recorded)).then(|| {
        format!("calibration set {name:?} holds from {from} until {until}; it was used on what was recorded on {recorded}")
    })
}

impl Calibrated {
    /// What a session's start document says.
    pub(super) fn of(start: &StartDocument) -> Result<Self, InstrumentError> {
        let Some(CalibrationDocument { name, set, force, stage }) = &start.calibration else {
            return Ok(Self::default());
        };
        let mut found = Self::default();
        let digits = set.sha256.get(..12).unwrap_or(&set.sha256);
        found.words.push(format!("calibration set {name:?} (SHA-256 {digits}…)"));
        found.doubt = out_of_date(name, &set.text, &start.started_utc);
        if let Some(text) = force {
            let file = ForceFile::parse(Path::new("force calibration of the session"), &text.text)?;
            found.words.push(format!(
                "force: gains and cross-talk of {} taken out; up to {:.2} N its uncertainty leaves {:.2} % of a force",
                file.date,
                file.range_n,
                100.0 * (0..3).map(|i| file.correction_sd[i][i]).fold(0.0, f64::max)
            ));
            found.force = Some(file);
        }
        if let Some(text) = stage {
            let file = StageFile::parse(Path::new("stage calibration of the session"), &text.text)?;
            for number in 0..AXES {
                let Some(axis) = file.axis(number) else { continue };
                found.scale[number] = axis.scale[0];
                found.place_sd_m = found.place_sd_m.max(axis.place_sd_m());
                found.words.push(format!(
                    "stage: axis {number} stretched by {:+.1} ± {:.1} µm/m; its noise carries {:.1} µm of backlash and scatter",
                    1e6 * axis.scale[0],
                    1e6 * axis.scale[1],
                    1e6 * axis.place_sd_m()
                ));
            }
        }
        Ok(found)
    }

    /// Force (N) and moment about the tip (N·m) on the phantom, from a reading less its zero.
    pub(super) fn on_phantom(&self, sensor: &SensorMounting, reading: [f64; 6]) -> (Vec3, Vec3) {
        let Some(force) = &self.force else { return sensor.on_phantom(reading) };
        let mut wrench = force.wrench(reading);
        if force.frame == Frame::Phantom {
            let back = sensor.to_phantom.transpose();
            let turned = [0, 3].map(|k| back * Vec3::new(wrench[k], wrench[k + 1], wrench[k + 2]));
            wrench = std::array::from_fn(|k| turned[k / 3][k % 3]);
        }
        // It is what acts on the tool, whichever sign the sensor reads with.
        SensorMounting { reads_reaction: true, ..*sensor }.on_phantom(wrench)
    }

    /// A reported displacement from a site put right (m).
    pub(super) fn displacement(&self, mounting: &Mounting, reported_m: Vec3) -> Vec3 {
        let motion = mounting.motion_for(reported_m);
        reported_m + mounting.moved_by(std::array::from_fn(|axis| motion[axis] * self.scale[axis]))
    }
}

/// How the sensor lies, by the session's document.
pub(super) fn sensor(document: &crate::session::MountingDocument) -> SensorMounting {
    SensorMounting {
        to_phantom: Mat3::from_fn(|i, j| document.sensor_to_phantom[i][j]),
        tip_m: document.sensor_to_tip_m.into(),
        reads_reaction: document.reads_reaction,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A calibration file with this correction.
    fn file(frame: &str, correction: [[f64; 6]; 6]) -> ForceFile {
        let zeros = [[0.0; 6]; 6];
        let text = format!(
            "format = \"phantom-force-calibration/1\"\ndate = \"2026-11-24\"\nserial = \"\"\nnote = \"\"\nframe = \"{frame}\"\n\
             table = \"w.csv\"\ntable_sha256 = \"\"\nrows = 48\ntold = 6\nrange_n = 2.0\nrange_nm = 0.1\nnoise = {0:?}\n\
             half_90 = 1.7\nbias = {0:?}\nbias_sd = {0:?}\nturn_rad = [0.0, 0.0, 0.0]\nturn_sd_rad = [0.0, 0.0, 0.0]\n\
             correction = {correction:?}\ncorrection_sd = {zeros:?}\nmisfits = []\n",
            [0.0; 6]
        );
        ForceFile::parse(Path::new("force.toml"), &text).expect("sound")
    }

    /// A sensor turned by 90° about z, 40 mm above the tip, that reads twice what pulls at the tool, or twice the opposite: the phantom
    /// feels the same wrench whatever axes the weights were hung along.
    #[test]
    fn gain_sign_and_turn_are_taken_back_in_either_frame() {
        let turned = Mat3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
        let (force, moment) = (Vec3::new(0.3, -0.1, -1.2), Vec3::new(0.01, 0.02, -0.005));
        for sign in [1.0, -1.0] {
            let mounting = SensorMounting {
                to_phantom: turned,
                tip_m: Vec3::new(0.0, 0.0, 0.04),
                reads_reaction: sign > 0.0,
            };
            let wrench = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
            let reading = mounting.sensed(wrench).map(|r| 2.0 * r);
            let half = 0.5 * sign;
            let diagonal = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { half } else { 0.0 }));
            let in_phantom = std::array::from_fn(|i| {
                std::array::from_fn(|j| if i / 3 == j / 3 { half * turned[(i % 3, j % 3)] } else { 0.0 })
            });
            for file in [file("sensor", diagonal), file("phantom", in_phantom)] {
                let calibrated = Calibrated { force: Some(file), ..Calibrated::default() };
                let (f, m) = calibrated.on_phantom(&mounting, reading);
                assert!((f - force).norm() < 1e-12 && (m - moment).norm() < 1e-12, "{sign}: {f} {m}");
            }
        }
    }

    #[test]
    fn a_set_is_doubted_on_days_on_which_it_does_not_hold() {
        let set = "format = \"phantom-calibration-set/1\"\nname = \"autumn\"\nvalid_from = \"2026-09-01\"\nvalid_until = \"2026-11-24\"\n";
        let doubt = |started: &str| out_of_date("autumn", set, started);
        for within in ["2026-09-01T00:00:00Z", "2026-11-24T23:59:59.9Z"] {
            assert_eq!(doubt(within), None, "{within}");
        }
        let words = doubt("2026-11-25T00:00:01Z").expect("expired");
        assert!(words.contains("\"autumn\" holds from 2026-09-01 until 2026-11-24"), "{words}");
        assert!(words.ends_with("recorded on 2026-11-25"), "{words}");
        assert!(doubt("2026-08-31T12:00:00Z").is_some());
        // A set in no known form, or a time that is none, says nothing of days.
        assert_eq!(out_of_date("autumn", "name = \"autumn\"\n", "2026-11-25T00:00:01Z"), None);
        assert_eq!(doubt("yesterday"), None);
    }

    /// Along the first axis 1 ‰ more, along the second, downwards, 2 ‰ less; beside both nothing.
    #[test]
    fn a_way_is_stretched_along_each_axis() {
        let calibrated = Calibrated { scale: [1e-3, -2e-3], ..Calibrated::default() };
        let mounting = Mounting::new([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 1e-4).expect("two axes");
        let moved = calibrated.displacement(&mounting, Vec3::new(1e-3, 1e-5, -3e-3));
        assert!((moved - Vec3::new(1.001e-3, 1e-5, -2.994e-3)).norm() < 1e-15, "{moved}");
    }
}

//! What a session of a whole run says as a recording, as it came and put right by a calibration of the instruments.

use super::{STIFFNESS, run, run_into};
use crate::steady::steady;
use phantom_rig::clock::Rows;
use phantom_rig::dataset::read_sessions;
use phantom_rig::mesh::{Block, block as block_mesh};
use phantom_rig::session::{CalibrationDocument, HashedText, Session};

/// The recording says what the spring did: no force at rest, depth times stiffness in the hold, contact as long as the tip was past
/// the surface.
#[test]
fn a_session_becomes_the_recording_of_what_happened() {
    steady(|| {
        let after = run(3.0, false, |_| {});
        let block = Block { size_m: [0.1, 0.15, 0.025], cells: [4, 6, 2] };
        let from = read_sessions(std::slice::from_ref(&after.session), block_mesh(&block).expect("a block"))
            .expect("a recording");
        assert!(from.remarks.is_empty(), "{:?}", from.remarks);
        let recording = from.recording;
        assert_eq!(recording.pokes.len(), 2);
        for (poke, (depth, x)) in recording.pokes.iter().zip([(0.003, 0.05), (0.002, 0.055)]) {
            assert!((poke.site.x - x).abs() < 1e-12 && poke.direction.z == -1.0);
            // In and out at 4 mm/s and 200 mm/s², which ends and begins with v/2a at the depth, and 1.5 s of hold.
            let expected = 2.0 * (depth / 0.004 + 0.004 / (2.0 * 0.2)) + 1.5;
            let lasted = poke.end_s - poke.start_s;
            assert!((lasted - expected).abs() < 0.15, "{lasted} s, not {expected} s");
            let held =
                |t: f64| t > poke.start_s + depth / 0.004 + 0.3 && t < poke.end_s - depth / 0.004 - 0.3;
            let wrench = &recording.wrench;
            let rows = wrench
                .time_s
                .iter()
                .zip(&wrench.force_n)
                .zip(&wrench.torque_nm)
                .filter(|((t, _), _)| held(**t));
            let mut seen = 0;
            for ((_, force), torque) in rows {
                assert!((force[2] + STIFFNESS * depth).abs() < 0.005, "{force:?}");
                assert!(torque.iter().all(|m| m.abs() < 1e-4), "{torque:?}");
                seen += 1;
            }
            assert!(seen > 20, "{seen} rows");
            let stage = recording.stage.as_ref().expect("a stage");
            let deepest = stage.time_s.iter().zip(&stage.displacement_m).filter(|(t, _)| held(**t));
            assert!(deepest.clone().count() > 5);
            assert!(deepest.clone().all(|(_, u)| (u[2] + depth).abs() < 3e-6 && u[0].abs() < 3e-6));
        }
        // Force and stage run on one clock: on the way in the force is that of the depth at the same time.
        let (wrench, stage) = (&recording.wrench, recording.stage.as_ref().expect("a stage"));
        let first = recording.pokes[0];
        let rows = Rows::new(&stage.time_s);
        let off = wrench.time_s.iter().zip(&wrench.force_n).filter_map(|(&t, force)| {
            let moved = rows.at(&stage.displacement_m, t, first.start_s, first.end_s)?;
            Some((force[2] - STIFFNESS * moved[2]).abs())
        });
        let largest = off.fold(0.0, f64::max);
        // 1 N/s on the way: 20 ms of it.
        assert!(largest < 0.02, "{largest} N");
        assert!(
            wrench
                .time_s
                .iter()
                .zip(&wrench.force_n)
                .filter(|(t, _)| **t < recording.rest_until_s)
                .all(|(_, f)| f[2].abs() < 1e-3)
        );
    });
}

/// A set whose second axis, which goes down, makes 1 % more way than it says, and whose forces are a tenth too large.
fn calibration() -> CalibrationDocument {
    let six = |diagonal: f64| -> Vec<[f64; 6]> {
        (0..6).map(|i| std::array::from_fn(|j| if i == j { diagonal } else { 0.0 })).collect()
    };
    let zero = [0.0; 6];
    let force = format!(
        "format = \"phantom-force-calibration/1\"\ndate = \"2026-11-24\"\nserial = \"\"\nnote = \"\"\nframe = \"sensor\"\ntable = \"w.csv\"\n\
         table_sha256 = \"\"\nrows = 48\ntold = 6\nrange_n = 2.0\nrange_nm = 0.1\nnoise = {zero:?}\nhalf_90 = 1.7\nbias = {zero:?}\n\
         bias_sd = {zero:?}\nturn_rad = [0.0, 0.0, 0.0]\nturn_sd_rad = [0.0, 0.0, 0.0]\ncorrection = {:?}\ncorrection_sd = {:?}\n\
         misfits = []\n",
        six(0.9),
        six(0.0)
    );
    let axis = |name: &str, scale: f64| {
        let pairs = ["accuracy", "repeatability", "reversal", "systematic", "mean_deviation", "range"];
        let pairs: String = pairs.iter().map(|p| format!("{p}_m = [0.0, 0.0]\n")).collect();
        format!(
            "[[axis]]\nname = \"{name}\"\nscale = [{scale:?}, 1e-4]\nbacklash_m = [12e-6, 0.0]\nscatter_m = 0.0\n{pairs}misfits = []\n"
        )
    };
    let stage = format!(
        "format = \"phantom-stage-calibration/1\"\ndate = \"2026-11-24\"\nserial = \"\"\nnote = \"\"\ntables = []\n{}{}",
        axis("0", 0.0),
        axis("1", 0.01)
    );
    CalibrationDocument {
        name: "made".to_owned(),
        set: HashedText::new("the set"),
        force: Some(HashedText::new(force)),
        stage: Some(HashedText::new(stage)),
    }
}

/// The way on from a site is as long as the gauge found, forces are as the weights found; when and where the tip touches is what it was,
/// and the stage's noise carries the backlash.
#[test]
fn a_calibration_puts_a_session_right() {
    steady(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let session = folder.path().join("session");
        run_into(&session, 3.0, Some(calibration()), false, |_| {});
        let session = Session::open(&session).expect("a session");
        let block = Block { size_m: [0.1, 0.15, 0.025], cells: [4, 6, 2] };
        let read = read_sessions(std::slice::from_ref(&session), block_mesh(&block).expect("a block"));
        let from = read.expect("a recording");
        assert!(from.calibration.iter().any(|words| words.contains("made")), "{:?}", from.calibration);
        let recording = from.recording;
        let stage = recording.stage.as_ref().expect("a stage");
        for (poke, depth) in recording.pokes.iter().zip([0.003, 0.002]) {
            let expected = 2.0 * (depth / 0.004 + 0.004 / (2.0 * 0.2)) + 1.5;
            assert!((poke.end_s - poke.start_s - expected).abs() < 0.15, "{} s", poke.end_s - poke.start_s);
            let held =
                |t: f64| t > poke.start_s + depth / 0.004 + 0.3 && t < poke.end_s - depth / 0.004 - 0.3;
            let moved: Vec<f64> = stage
                .time_s
                .iter()
                .zip(&stage.displacement_m)
                .filter(|(t, _)| held(**t))
                .map(|(_, u)| u[2])
                .collect();
            assert!(moved.len() > 5 && moved.iter().all(|z| (z + 1.01 * depth).abs() < 3e-6), "{moved:?}");
            let wrench = &recording.wrench;
            let forces: Vec<f64> = wrench
                .time_s
                .iter()
                .zip(&wrench.force_n)
                .filter(|(t, _)| held(**t))
                .map(|(_, f)| f[2])
                .collect();
            assert!(forces.len() > 20 && forces.iter().all(|f| (f + 0.9 * STIFFNESS * depth).abs() < 0.005));
        }
        // 12 µm of backlash, anywhere: 12/√12 µm, and the step's rounding.
        let noise = recording.noise.stage_m[2];
        assert!((3.4e-6..3.6e-6).contains(&noise), "{noise}");
    });
}

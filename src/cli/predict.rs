//! `predict`: recordings of a body under dead loads → modulus at finite strain, and where another load takes its markers.

use super::{Context, Exit, Outcome, UsageError};
use crate::dataset::read_bundle;
use crate::geometry::Vec3;
use crate::inverse::dead_load::{Case, Hanging, Hung, MarkerAt, cases, hang};
use crate::observation::Recording;
use crate::units::{counted, pascals, with_sd};
use anyhow::bail;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Predicts where a load takes the markers of a hanging body, from recordings of it under other loads.
///
/// For dead loads (weights, no stage) and large rotations: the body is neo-Hookean, held as its mesh says and by nothing else. Finds
/// the modulus from all recordings and says what each would say by itself. Deviations come from what differs between the
/// recordings, so that two at least are wanted: with one, which shows no such difference, the exit code is 3. So it is when what was
/// measured in the recording of --of lies outside the 90 % intervals. Writes nothing.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  phantom-rig predict recordings/beam-weight recordings/beam-50g --force-n 0,0,-1
  phantom-rig predict recordings/beam-weight recordings/beam-50g --of recordings/beam-100g --json")]
pub(super) struct PredictArguments {
    /// Recordings of the same body to learn from, as bundles
    #[arg(value_name = "BUNDLE", required = true)]
    bundles: Vec<PathBuf>,
    /// Force on the disc of the first recording's first poke, beside the weight
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        required_unless_present = "of",
        conflicts_with = "of"
    )]
    force_n: Option<Vec<f64>>,
    /// A recording whose loads are taken, and whose markers are compared
    #[arg(long, value_name = "BUNDLE")]
    of: Option<PathBuf>,
}

pub(super) fn run(arguments: &PredictArguments, context: &Context) -> anyhow::Result<Outcome> {
    let force = arguments.force_n.as_deref().map(force).transpose()?;
    let spinner = context.progress.spinner("reading");
    let read = |path: &PathBuf| -> anyhow::Result<Recording> { Ok(read_bundle(path)?.0) };
    let recordings = arguments.bundles.iter().map(read).collect::<anyhow::Result<Vec<_>>>()?;
    let first = &recordings[0];
    for (other, path) in recordings.iter().zip(&arguments.bundles).skip(1) {
        same_body(first, other, path)?;
    }
    let mut known = Vec::new();
    for recording in &recordings {
        known.extend(cases(recording)?);
    }
    let asked = match (&arguments.of, force) {
        (Some(path), _) => {
            let other = read(path)?;
            same_body(first, &other, path)?;
            cases(&other)?
        }
        (None, Some(force_n)) => known.first().map(|case| under(case, force_n)).into_iter().collect(),
        (None, None) => Vec::new(),
    };
    let hanging = Hanging {
        mesh: &first.mesh,
        poisson_ratio: first.phantom.poisson_ratio,
        modulus_range_pa: first.phantom.modulus_range_pa,
    };
    spinner.label("looking for equilibria at finite strain");
    let found = hang(&hanging, &known, &asked, &mut |unknowns| {
        spinner.label(&format!("looking for equilibria at finite strain ({unknowns} unknowns)"));
    })?;
    drop(spinner);
    let outside = asked
        .iter()
        .zip(&found.predicted)
        .flat_map(|(case, at)| case.markers.iter().zip(at))
        .filter(|(_, at)| !at.on_load)
        .any(|(marker, at)| marker.moved.is_some_and(|moved| outside(&(moved - at.moved), at, &found).any()));
    Ok(Outcome {
        exit: if outside || is_of_one(&found) { Exit::Degraded } else { Exit::Good },
        text: told(&found, &asked, outside),
        json: as_json(&found, &asked),
    })
}

/// Whether all that is known comes from a single recording.
fn is_of_one(found: &Hung) -> bool {
    found.alone.windows(2).all(|two| two[0].recording == two[1].recording)
}

fn force(numbers: &[f64]) -> anyhow::Result<Vec3> {
    match numbers {
        [x, y, z] if numbers.iter().all(|f| f.is_finite()) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err(UsageError(format!(
            "--force-n wants three numbers in newtons, as in 0,0,-1; got {numbers:?}"
        ))
        .into()),
    }
}

/// The same load case with another force, its markers not seen.
fn under(case: &Case, force_n: Vec3) -> Case {
    let mut asked = case.clone();
    asked.load.force_n = force_n;
    asked.load.torque_nm = Vec3::zeros();
    asked.markers.iter_mut().for_each(|marker| marker.moved = None);
    asked
}

fn same_body(first: &Recording, other: &Recording, path: &Path) -> anyhow::Result<()> {
    if first.mesh != other.mesh {
        bail!(
            "{}: its mesh is not that of {}: recordings of one body are wanted",
            path.display(),
            first.name
        );
    }
    if first.phantom.poisson_ratio != other.phantom.poisson_ratio {
        bail!(
            "{}: it states a Poisson's ratio of {}, {} one of {}",
            path.display(),
            other.phantom.poisson_ratio,
            first.name,
            first.phantom.poisson_ratio
        );
    }
    Ok(())
}

/// Along which axes a measured displacement lies outside the 90 % interval.
struct Outside([bool; 3]);

impl Outside {
    fn any(&self) -> bool {
        self.0.iter().any(|o| *o)
    }
}

fn outside(difference: &Vec3, at: &MarkerAt, found: &Hung) -> Outside {
    Outside(std::array::from_fn(|i| difference[i].abs() > found.half_width * at.sd[i]))
}

fn told(found: &Hung, asked: &[Case], outside: bool) -> String {
    let modulus = found.young_modulus_pa;
    let [x, y, z] = found.left_m.map(|m| 1e3 * m);
    let mut text = format!(
        "Young’s modulus {} at small strain (neo-Hookean, {} unknowns), from {}\n",
        with_sd(modulus.value, modulus.sd, 1e-3, "kPa"),
        found.unknowns,
        counted(found.units, "independent unit", "independent units"),
    );
    for alone in &found.alone {
        let by_itself = pascals(alone.young_modulus_pa);
        text.push_str(&format!("  {}, poke {}: {by_itself} by itself\n", alone.recording, alone.poke));
    }
    text.push_str(&format!(
        "Left along x, y, z: {x:.2}, {y:.2}, {z:.2} mm (root mean square). The elements may be off by {:.2} % of the modulus.\n",
        100.0 * found.elements
    ));
    if is_of_one(found) {
        text.push_str(
            "note: one recording does not show how recordings differ; its markers count as independent, and all intervals are too narrow. \
             Give a second one\n",
        );
    }
    for (case, at) in asked.iter().zip(&found.predicted) {
        let f = case.load.force_n;
        text.push_str(&format!(
            "Under ({:.4}, {:.4}, {:.4}) N the markers move by (mm, 90 % interval of a measurement)\n",
            f.x, f.y, f.z
        ));
        for (marker, at) in case.markers.iter().zip(at) {
            let axis =
                |i: usize| format!("{:8.2} ± {:.2}", 1e3 * at.moved[i], 1e3 * found.half_width * at.sd[i]);
            let note =
                if at.on_load { "  (on the loaded disc: depends on how the load is spread)" } else { "" };
            text.push_str(&format!("  {:>3}  {}  {}  {}{note}\n", at.number, axis(0), axis(1), axis(2)));
            if let Some(moved) = marker.moved {
                let measured = |i: usize| format!("{:8.2}       ", 1e3 * moved[i]);
                text.push_str(&format!("  was  {}{}{}\n", measured(0), measured(1), measured(2)));
            }
        }
    }
    if outside {
        text.push_str("What was measured lies outside these intervals in places: the model does not carry over to that load.\n");
    }
    text.push_str("Held is what the mesh says; no restraint was looked for.");
    text
}

fn as_json(found: &Hung, asked: &[Case]) -> serde_json::Value {
    let three = |v: Vec3| <[f64; 3]>::from(v);
    json!({
        "format": "phantom-prediction/1",
        "law": "neo-hookean",
        "young_modulus_pa": { "value": found.young_modulus_pa.value, "sd": found.young_modulus_pa.sd },
        "half_width_90_over_sd": found.half_width,
        "independent_units": found.units,
        "one_recording": is_of_one(found),
        "alone": found.alone.iter().map(|a| json!({
            "recording": a.recording, "poke": a.poke, "young_modulus_pa": a.young_modulus_pa,
        })).collect::<Vec<_>>(),
        "left_m": found.left_m,
        "elements_relative": found.elements,
        "predicted": asked.iter().zip(&found.predicted).map(|(case, at)| json!({
            "force_n": three(case.load.force_n),
            "torque_nm": three(case.load.torque_nm),
            "site_m": three(case.load.site),
            "markers": case.markers.iter().zip(at).map(|(marker, at)| json!({
                "marker": at.number,
                "rest_m": three(at.rest),
                "moved_m": three(at.moved),
                "sd_m": three(at.sd),
                "on_load": at.on_load,
                "measured_m": marker.moved.map(three),
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inverse::Estimate;
    use crate::inverse::dead_load::{Alone, CaseMarker, DeadLoad};

    /// Every number is told with its unit, what was measured stands under what was predicted, and a marker on the load is said to be.
    #[test]
    fn a_prediction_is_told() {
        let rest = Vec3::new(0.1, 0.0, 0.02);
        let at = |number, on_load| MarkerAt {
            number,
            rest,
            moved: Vec3::new(1e-3, 0.0, -2e-2),
            on_load,
            sd: Vec3::new(1e-4, 1e-4, 2e-4),
        };
        let load = DeadLoad {
            force_n: Vec3::new(0.0, 0.0, -0.5),
            torque_nm: Vec3::zeros(),
            site: rest,
            direction: -Vec3::z(),
            radius_m: 0.005,
            weight_n_m3: Vec3::zeros(),
        };
        let markers = [(4, None), (5, Some(Vec3::new(0.0, 0.0, -0.0205)))]
            .map(|(number, moved)| CaseMarker { number, rest, moved });
        let asked = [Case { recording: "asked".to_owned(), poke: 1, load, markers: markers.to_vec() }];
        let found = Hung {
            young_modulus_pa: Estimate { value: 2.64e5, sd: 4.6e3 },
            half_width: 2.0,
            alone: vec![Alone { recording: "light".to_owned(), poke: 2, young_modulus_pa: 2.7e5 }],
            left_m: [3e-4, 5e-4, 4e-4],
            units: 3,
            elements: 1.6e-3,
            unknowns: 1000,
            predicted: vec![vec![at(4, true), at(5, false)]],
        };
        let text = told(&found, &asked, true);
        for words in [
            "264.0 ± 4.6 kPa",
            "from 3 independent units",
            "note: one recording does not show how recordings differ",
            "  light, poke 2: 270.00 kPa by itself",
            "0.30, 0.50, 0.40 mm",
            "off by 0.16 % of the modulus",
            "Under (0.0000, 0.0000, -0.5000) N",
            "    4      1.00 ± 0.20      0.00 ± 0.20    -20.00 ± 0.40  (on the loaded disc",
            "  was      0.00           0.00         -20.50",
            "does not carry over",
        ] {
            assert!(text.contains(words), "{words:?} is not in\n{text}");
        }
        let mut two = found.clone();
        two.alone.push(Alone { recording: "heavy".to_owned(), poke: 1, young_modulus_pa: 2.6e5 });
        assert!(!told(&two, &asked, true).contains("one recording"));
        assert!(!outside(&Vec3::new(1e-4, 0.0, -3.9e-4), &at(5, false), &found).any());
        assert!(outside(&Vec3::new(2.1e-4, 0.0, 0.0), &at(5, false), &found).any());
    }
}

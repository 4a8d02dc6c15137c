//! What a checked recording may hold but probably should not: units, signs, noise, empty pokes.
//!
//! A suspicion refuses nothing. Its limits are wide on purpose: each says "no bench phantom is like this", not
//! "this is unusual".

use super::attach::diagonal_m;
use super::rest::rest_noise;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::mesh::{SurfaceIndex, boundary_triangles};
use crate::observation::{Poke, Recording};
use crate::units::three_digits;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Something allowed that looks like a mistake.
#[derive(Debug, Clone, PartialEq)]
pub enum Suspicion {
    /// A CSV file whose last row does not end in a line end: it may have been cut off inside its last number.
    NoFinalNewline {
        /// The file.
        file: PathBuf,
    },
    /// A size that no bench has in the unit that the format asks for.
    Unit {
        /// What, and where it stands.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit by the format.
        unit: &'static str,
        /// What would be believed.
        expected: RangeInclusive<f64>,
        /// The unit that it may be in.
        perhaps: &'static str,
    },
    /// A channel whose noise at rest is not the stated one.
    Noise {
        /// The channel.
        channel: &'static str,
        /// Stated standard deviation along x, y and z (SI).
        stated: [f64; 3],
        /// Measured standard deviation (SI).
        measured: [f64; 3],
    },
    /// The tip pulls, or the sensor's reaction was recorded instead of the tip's force.
    ForceSign {
        /// Number of the poke.
        poke: u32,
        /// Mean force along the poke's direction (N), negative.
        along_n: f64,
        /// Its standard error by the stated noise (N).
        standard_error_n: f64,
    },
    /// The stage moves out of the phantom.
    StageSign {
        /// Number of the poke.
        poke: u32,
        /// Mean displacement along the poke's direction (m), negative.
        along_m: f64,
    },
    /// A direction that leads away from the phantom.
    DirectionOutward {
        /// Number of the poke.
        poke: u32,
        /// Cosine of the angle between direction and outward normal at the site.
        cosine: f64,
    },
    /// A poke without rows of a channel.
    NothingRecorded {
        /// Number of the poke.
        poke: u32,
        /// The channel.
        channel: &'static str,
    },
}

impl fmt::Display for Suspicion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoFinalNewline { file } => write!(
                f,
                "{}: the last row has no line end; the file may have been cut off inside its last number",
                file.display()
            ),
            Self::Unit { what, value, unit, expected, perhaps } => write!(
                f,
                "{what} is {value} {unit}; a bench has {} to {} {unit}: is it in {perhaps}?",
                three_digits(*expected.start()),
                three_digits(*expected.end())
            ),
            Self::Noise { channel, stated, measured } => {
                let [x, y, z] = std::array::from_fn(|i| measured[i] / stated[i]);
                write!(
                    f,
                    "the {channel}'s noise at rest is {x:.2}, {y:.2}, {z:.2} times the stated one along x, y, z"
                )?;
                let perhaps = match *channel {
                    "force" => "mN",
                    "torque" => "mN·m",
                    _ => "mm",
                };
                match [x, y, z].iter().all(|ratio| A_THOUSAND.contains(ratio)) {
                    true => write!(f, ": is it in {perhaps}?"),
                    false => Ok(()),
                }
            }
            Self::ForceSign { poke, along_n, standard_error_n } => write!(
                f,
                "force.csv: in poke {poke} the mean force along the poke's direction is {along_n:.4} N (standard error {standard_error_n:.4} N): is it the phantom's force on the tip?"
            ),
            Self::StageSign { poke, along_m } => write!(
                f,
                "stage.csv: in poke {poke} the mean displacement along the poke's direction is {along_m:.2e} m: is the stage's sign turned?"
            ),
            Self::DirectionOutward { poke, cosine } => write!(
                f,
                "pokes.csv: the direction of poke {poke} leads out of the phantom (cosine {cosine:.2} with the outward normal)"
            ),
            Self::NothingRecorded { poke, channel } => {
                write!(f, "poke {poke} has no {channel} rows between its start and its end")
            }
        }
    }
}

/// Noise at rest of these multiples of the stated one is as if it were written down in thousandths.
const A_THOUSAND: RangeInclusive<f64> = 500.0..=2000.0;

/// Noise at rest between these multiples of the stated one is believed.
const NOISE_RATIOS: RangeInclusive<f64> = 0.5..=2.0;
/// Degrees of freedom below which measured noise says too little: at 30 a ratio of 2 is 7 standard errors off.
const NOISE_DEGREES_OF_FREEDOM: usize = 30;
/// Standard errors by which a mean force must be negative to be called so.
const SURE_SIGN: f64 = 10.0;

/// Everything suspicious about `recording`.
pub(super) fn suspicions(recording: &Recording) -> Vec<Suspicion> {
    let mut found = units(recording);
    found.extend(noise(recording));
    let boundary = boundary_triangles(&recording.mesh).unwrap_or_default();
    let surface = SurfaceIndex::new(&recording.mesh, &boundary);
    for poke in &recording.pokes {
        found.extend(direction(recording, &boundary, &surface, poke));
        found.extend(wrench_of(recording, poke));
        found.extend(stage_of(recording, poke));
        let frames = Rows::new(&recording.markers.frame_time_s).within(poke.start_s, poke.end_s);
        if frames.is_empty() {
            found.push(Suspicion::NothingRecorded { poke: poke.number, channel: "marker" });
        }
    }
    found
}

/// Channels whose noise at rest is not the stated one. A stage that counts its steps stands exactly still; and without a stage the wrench
/// may be a dead load that was written down, not measured. What is exactly constant there is nothing wrong.
fn noise(recording: &Recording) -> Vec<Suspicion> {
    let exact = |channel: &str, measured: f64| {
        measured == 0.0 && (channel == "stage" || recording.stage.is_none() && channel != "marker")
    };
    rest_noise(recording)
        .channels()
        .filter(|(channel, noise)| {
            let believed =
                |i: usize| NOISE_RATIOS.contains(&noise.ratio()[i]) || exact(channel, noise.measured[i]);
            noise.degrees_of_freedom >= NOISE_DEGREES_OF_FREEDOM && !(0..3).all(believed)
        })
        .map(|(channel, noise)| Suspicion::Noise { channel, stated: noise.stated, measured: noise.measured })
        .collect()
}

/// Sizes that give a wrong unit away.
fn units(recording: &Recording) -> Vec<Suspicion> {
    let largest = |rows: &[[f64; 3]]| rows.iter().map(|r| Vec3::from(*r).norm()).fold(0.0, f64::max);
    let body = diagonal_m(&recording.mesh);
    let phantom = &recording.phantom;
    let radius = recording.pokes.iter().map(|p| p.radius_m).fold(0.0, f64::max);
    let mut spacing: Vec<f64> = recording.markers.frame_time_s.windows(2).map(|w| w[1] - w[0]).collect();
    spacing.sort_by(f64::total_cmp);
    let mut checks = vec![
        ("the diagonal of the mesh", body, "m", 0.005..=3.0, "millimetres"),
        ("the largest tip radius (pokes.csv, radius_m)", radius, "m", 0.0..=body, "millimetres"),
        (
            "the largest force (force.csv)",
            largest(&recording.wrench.force_n),
            "N",
            0.0..=1000.0,
            "millinewtons, or counts",
        ),
        (
            "the largest torque (force.csv)",
            largest(&recording.wrench.torque_nm),
            "N·m",
            0.0..=100.0,
            "newton millimetres",
        ),
        ("phantom.density_kg_m3", phantom.density_kg_m3, "kg/m³", 10.0..=30_000.0, "g/cm³"),
        (
            "phantom.modulus_range_pa, the lower end",
            phantom.modulus_range_pa[0],
            "Pa",
            10.0..=1e9,
            "kilopascals",
        ),
        (
            "phantom.modulus_range_pa, the upper end",
            phantom.modulus_range_pa[1],
            "Pa",
            200.0..=1e12,
            "kilopascals",
        ),
    ];
    if let Some(stage) = &recording.stage {
        let reach = largest(&stage.displacement_m);
        checks.push(("the largest displacement (stage.csv)", reach, "m", 0.0..=body, "millimetres"));
    }
    if let Some(gravity) = &phantom.gravity {
        let size = gravity.acceleration_m_s2.norm();
        checks.push(("phantom.gravity_m_s2", size, "m/s²", 0.0..=30.0, "mm/s²"));
    }
    if let Some(&median) = spacing.get(spacing.len() / 2) {
        checks.push(("the median time between marker frames", median, "s", 1e-5..=5.0, "milliseconds"));
    }
    checks
        .into_iter()
        .filter(|(_, value, _, expected, _)| !expected.contains(value))
        .map(|(what, value, unit, expected, perhaps)| Suspicion::Unit {
            what,
            value,
            unit,
            expected,
            perhaps,
        })
        .collect()
}

fn direction(
    recording: &Recording,
    boundary: &[[u32; 3]],
    surface: &SurfaceIndex,
    poke: &Poke,
) -> Option<Suspicion> {
    let triangle = surface.nearest(&poke.site)?.triangle;
    let cosine = recording.mesh.triangle(boundary[triangle]).normal().dot(&poke.direction);
    // At an edge the nearest triangle may be one that the direction runs along.
    (cosine > 0.2).then_some(Suspicion::DirectionOutward { poke: poke.number, cosine })
}

fn wrench_of(recording: &Recording, poke: &Poke) -> Option<Suspicion> {
    let rows = Rows::new(&recording.wrench.time_s).within(poke.start_s, poke.end_s);
    if rows.is_empty() {
        return Some(Suspicion::NothingRecorded { poke: poke.number, channel: "force" });
    }
    let count = rows.len() as f64;
    let mean: Vec3 = recording.wrench.force_n[rows].iter().map(|f| Vec3::from(*f)).sum::<Vec3>() / count;
    let along_n = mean.dot(&poke.direction);
    let sigma = Vec3::from(recording.noise.force_n).component_mul(&poke.direction).norm();
    let standard_error_n = sigma / count.sqrt();
    (along_n < -SURE_SIGN * standard_error_n).then_some(Suspicion::ForceSign {
        poke: poke.number,
        along_n,
        standard_error_n,
    })
}

fn stage_of(recording: &Recording, poke: &Poke) -> Option<Suspicion> {
    let stage = recording.stage.as_ref()?;
    let rows = Rows::new(&stage.time_s).within(poke.start_s, poke.end_s);
    if rows.is_empty() {
        return Some(Suspicion::NothingRecorded { poke: poke.number, channel: "stage" });
    }
    let count = rows.len() as f64;
    let mean: Vec3 = stage.displacement_m[rows].iter().map(|u| Vec3::from(*u)).sum::<Vec3>() / count;
    let along_m = mean.dot(&poke.direction);
    let sigma = Vec3::from(recording.noise.stage_m).component_mul(&poke.direction).norm();
    (along_m < -SURE_SIGN * sigma / count.sqrt())
        .then_some(Suspicion::StageSign { poke: poke.number, along_m })
}

//! What a recording says, boiled down to as many numbers as a linear model can use.
//!
//! In one poke everything observed is linear in what drives the model: a reading is `P x(t)` plus noise, where
//! `x` holds the stage's displacement, or what the tip answers to of it ([`Lift`]), or the wrench, and, last, the
//! constant 1 on which weight acts, and `P` depends on the unknown parameters alone. The rows of a poke therefore enter only through `Σ x xᵀ` and
//! `Σ y xᵀ`: along every principal direction `v` of the drive, all rows act like a single reading
//! `Σ y (x·v) / √λ` of `√λ P v` with the noise of one row. A recording of any length becomes a few thousand
//! numbers.
//!
//! Noise in the drive itself inflates `Σ x xᵀ`; its expectation is taken off, so that the slopes are not
//! flattened (errors in variables, Fuller 1987, section 2.2). The error of a marker's rest position is common to
//! all its readings; it is kept as the sensitivity of each reading to a common shift.

use super::error::InverseError;
use super::lift::{DriveNoise, Driving, Lift, lifts};
use super::sway::sway_m2;
use super::wander::wander;
use crate::clock::Rows;
use crate::geometry::Vec3;
use crate::observation::{MarkerRow, Noise, Poke, Recording};
use nalgebra::{SMatrix, SVector, SymmetricEigen};

/// Entries of the drive: displacement (3), series in the depth (4) or wrench (6), and the constant on which weight acts.
pub const DRIVE: usize = 7;
/// Index of the constant.
pub const WEIGHT: usize = 6;

/// What drives the model in a poke.
pub type Drive = SVector<f64, DRIVE>;

/// What sets the tip in motion in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driven {
    /// The stage's displacement: entries 0 to 2 of the drive (m), or what its [`Lift`] makes of it. Force and markers
    /// are readings.
    ByStage,
    /// The wrench: entries 0 to 5 of the drive (N, N·m). Markers are readings.
    ByWrench,
}

/// All rows of one channel along one principal direction of the drive, as one reading.
#[derive(Debug, Clone)]
pub struct Reading {
    /// `√λ v`: the drive that this reading answers to.
    pub drive: Drive,
    /// What was read.
    pub value: Vec3,
    /// How much the value moves when every row of the channel is shifted by one unit.
    pub shift: f64,
}

/// Pokes at one place.
#[derive(Debug, Clone)]
pub struct Site {
    /// Tip centre on the undeformed surface (m).
    pub centre: Vec3,
    /// Direction of its first poke: unit vector into the phantom.
    pub direction: Vec3,
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// Indices of its pokes in the recording.
    pub pokes: Vec<usize>,
    /// Readings of the force (N); none when the wrench drives the model.
    pub force: Vec<Reading>,
    /// Readings of every marker (m), in the recording's order of markers.
    pub markers: Vec<Vec<Reading>>,
    /// What of the stage's motion its tip answers to.
    pub lift: Lift,
    /// Mean covariance of the drive's own noise in the rows of the force.
    pub drive_noise: DriveNoise,
}

/// A recording, boiled down.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// What drives the model.
    pub driven: Driven,
    /// Pokes by place.
    pub sites: Vec<Site>,
    /// The lift of every poke.
    pub lifts: Vec<Lift>,
    /// Rest position of every marker (m), and rows it was averaged over.
    pub rest: Vec<(Vec3, usize)>,
    /// One standard deviation of every channel, as used.
    pub noise: Noise,
    /// Measured over stated noise, pooled over axes: force, then marker.
    pub measured_over_stated: [f64; 2],
    /// Variance (m²) of the markers' common motion between pokes along each axis, beyond that of their noise.
    pub sway_m2: [f64; 3],
    /// Variance of the wandering of the force's zero over that of a row.
    pub wander: f64,
}

#[cfg(test)]
impl Evidence {
    /// Readings of some sites that the stage drives, with this noise and no other error.
    pub(super) fn of_sites(sites: Vec<Site>, noise: Noise) -> Self {
        let (lifts, rest) = (Vec::new(), Vec::new());
        let (measured_over_stated, sway_m2) = ([1.0; 2], [0.0; 3]);
        Self {
            driven: Driven::ByStage,
            sites,
            lifts,
            rest,
            noise,
            measured_over_stated,
            sway_m2,
            wander: 0.0,
        }
    }
}

/// Principal directions of the drive that carry less than this share of the largest tell nothing that the noise of
/// the drive would not drown.
const NEGLIGIBLE: f64 = 1e-3;

/// Two pokes belong to one site when their centres and radii agree within this (m).
const SAME_PLACE_M: f64 = 1e-6;

#[derive(Clone)]
struct Sums {
    count: f64,
    xx: SMatrix<f64, DRIVE, DRIVE>,
    yx: SMatrix<f64, 3, DRIVE>,
    x: Drive,
    noise: DriveNoise,
}

impl Sums {
    fn new() -> Self {
        Self {
            count: 0.0,
            xx: SMatrix::zeros(),
            yx: SMatrix::zeros(),
            x: Drive::zeros(),
            noise: DriveNoise::zeros(),
        }
    }

    fn add(&mut self, Driving { x, noise, .. }: &Driving, y: &Vec3) {
        self.noise += noise;
        self.count += 1.0;
        self.xx += x * x.transpose();
        self.yx += y * x.transpose();
        self.x += x;
    }

    /// One reading for every principal direction that carries something.
    fn readings(&self) -> Vec<Reading> {
        if self.count == 0.0 {
            return Vec::new();
        }
        // Displacement, force and torque differ in unit: compare them after scaling each to its own size.
        let corrected = self.xx - self.noise;
        let size = Drive::from_fn(|i, _| corrected[(i, i)].max(0.0).sqrt());
        let noise = self.noise.diagonal();
        let chance = 3.0 * (2.0 / self.count).sqrt();
        let scale = Drive::from_fn(|i, _| {
            let group = size.rows(i / 3 * 3, if i < 6 { 3 } else { 1 }).norm_squared();
            let heard = size[i] * size[i] > NEGLIGIBLE * group;
            if heard && size[i] * size[i] > chance * noise[i] { 1.0 / size[i] } else { 0.0 }
        });
        let d = SMatrix::<f64, DRIVE, DRIVE>::from_diagonal(&scale);
        let eigen = SymmetricEigen::new(d * corrected * d);
        let largest = eigen.eigenvalues.max();
        let mut readings: Vec<Reading> = (0..DRIVE)
            .filter(|&i| eigen.eigenvalues[i] > NEGLIGIBLE * largest && largest > 0.0)
            .map(|i| {
                // With z = D x and z-direction v: x = D⁻¹ z, and rows weighted by (z·v)/√λ.
                let (lambda, v) = (eigen.eigenvalues[i], eigen.eigenvectors.column(i).into_owned());
                let mut weight = d * v / lambda.sqrt();
                // Rows weighted by x·w have the noise of one row times √(wᵀ Σxxᵀ w): 1 but for the drive's own noise.
                weight /= weight.dot(&(self.xx * weight)).sqrt();
                // Either sign is an eigenvector: readings of markers that are not seen in the same frames go the same way.
                if self.x.dot(&weight) < 0.0 {
                    weight = -weight;
                }
                Reading { drive: corrected * weight, value: self.yx * weight, shift: self.x.dot(&weight) }
            })
            .collect();
        readings.sort_by(|a, b| b.drive.norm().total_cmp(&a.drive.norm()));
        readings
    }
}

impl Evidence {
    /// Boils `recording` down. The stage drives the model when there is one, unless `driven` says otherwise.
    pub fn new(recording: &Recording, driven: Option<Driven>) -> Result<Self, InverseError> {
        let driven = match (driven, &recording.stage) {
            (Some(Driven::ByStage), None) => return Err(InverseError::NoStage),
            (Some(driven), _) => driven,
            (None, Some(_)) => Driven::ByStage,
            (None, None) => Driven::ByWrench,
        };
        let lifts = lifts(recording, driven)?;
        let rest = recording.rest_positions();
        let (noise, measured_over_stated) = measured_noise(recording, &rest);
        let mut sites: Vec<(Site, Sums, Vec<Sums>)> = Vec::new();
        let drive = DriveTrack::new(recording, driven, &lifts, &noise);
        for (index, poke) in recording.pokes.iter().enumerate() {
            let found = sites.iter().position(|(s, ..)| {
                (s.centre - poke.site).norm() < SAME_PLACE_M
                    && (s.radius_m - poke.radius_m).abs() < SAME_PLACE_M
                    && s.lift == lifts[index]
            });
            let at = found.unwrap_or_else(|| {
                let site = Site {
                    centre: poke.site,
                    direction: poke.direction,
                    radius_m: poke.radius_m,
                    pokes: Vec::new(),
                    force: Vec::new(),
                    markers: Vec::new(),
                    lift: lifts[index],
                    drive_noise: DriveNoise::zeros(),
                };
                sites.push((site, Sums::new(), vec![Sums::new(); rest.len()]));
                sites.len() - 1
            });
            let (site, force, markers) = &mut sites[at];
            site.pokes.push(index);
            if driven == Driven::ByStage {
                for i in Rows::new(&recording.wrench.time_s).within(poke.start_s, poke.end_s) {
                    if let Some(x) = drive.at(recording.wrench.time_s[i], index) {
                        force.add(&x, &Vec3::from(recording.wrench.force_n[i]));
                    }
                }
            }
            for (row, x) in drive.marker_rows(index) {
                let m = row.marker as usize;
                markers[m].add(&x, &(Vec3::from(row.position_m) - rest[m].0));
            }
        }
        let sites = sites
            .into_iter()
            .map(|(mut site, force, markers)| {
                site.force = force.readings();
                site.markers = markers.iter().map(Sums::readings).collect();
                site.drive_noise = force.noise / force.count.max(1.0);
                site
            })
            .collect();
        let sway_m2 = sway_m2(recording, &rest, noise.marker_m, |_, _| Some(Vec3::zeros()));
        let wander = wander(recording, noise.force_n);
        Ok(Self { driven, sites, lifts, rest, noise, measured_over_stated, sway_m2, wander })
    }

    /// Whether the force, where the stage drives the model, says more than its noise would.
    pub fn force_is_felt(&self) -> bool {
        let sd = Vec3::from(self.noise.force_n);
        let squares = |site: &Site| -> f64 {
            site.force.iter().map(|reading| reading.value.component_div(&sd).norm_squared()).sum()
        };
        let sum: f64 = self.sites.iter().map(squares).sum();
        let expected = 3.0 * self.sites.iter().map(|site| site.force.len()).sum::<usize>() as f64;
        self.driven == Driven::ByWrench || sum > expected + FELT_SD * (2.0 * expected).sqrt()
    }
}

/// Standard deviations of chance above which a force is felt.
const FELT_SD: f64 = 5.0;

/// The drive at any instant of a poke.
pub struct DriveTrack<'a> {
    recording: &'a Recording,
    driven: Driven,
    rows: Rows<'a>,
    weight: f64,
    lifts: &'a [Lift],
    noise: &'a Noise,
    /// How deep the tip was (m) in its poke up to every row of the stage, for tips that stick.
    deepest_m: Vec<f64>,
}

impl<'a> DriveTrack<'a> {
    /// Prepares look-ups in `recording`, with the lift of every poke and the noise to reckon with.
    pub fn new(recording: &'a Recording, driven: Driven, lifts: &'a [Lift], noise: &'a Noise) -> Self {
        let time = match (driven, &recording.stage) {
            (Driven::ByStage, Some(stage)) => &stage.time_s,
            _ => &recording.wrench.time_s,
        };
        let acts = recording.phantom.gravity.is_some_and(|g| !g.at_rest);
        let rows = Rows::new(time);
        let mut deepest_m = Vec::new();
        if let (Driven::ByStage, Some(stage)) = (driven, &recording.stage) {
            deepest_m.resize(time.len(), 0.0);
            for (poke, lift) in recording.pokes.iter().zip(lifts) {
                let Some(inward) = lift.inward() else { continue };
                let mut deepest = 0.0_f64;
                for i in rows.within(poke.start_s, poke.end_s) {
                    deepest = deepest.max(Vec3::from(stage.displacement_m[i]).dot(&inward));
                    deepest_m[i] = deepest;
                }
            }
        }
        Self { recording, driven, rows, weight: f64::from(u8::from(acts)), lifts, noise, deepest_m }
    }

    /// Marker rows inside a poke, each with the drive at its instant; rows in a gap of the drive are left out.
    pub fn marker_rows(&self, poke: usize) -> impl Iterator<Item = (&MarkerRow, Driving)> {
        let (index, poke) = (poke, &self.recording.pokes[poke]);
        let markers = &self.recording.markers;
        let time = |row: &MarkerRow| markers.frame_time_s[row.frame as usize];
        let first = markers.rows.partition_point(|row| time(row) < poke.start_s);
        let mut frame: Option<(u32, Option<Driving>)> = None;
        markers.rows[first..].iter().take_while(move |row| time(row) <= poke.end_s).filter_map(move |row| {
            let drive = match frame {
                Some((number, drive)) if number == row.frame => drive,
                _ => self.at(time(row), index),
            };
            frame = Some((row.frame, drive));
            drive.map(|drive| (row, drive))
        })
    }

    /// The drive at `at_s`, from rows inside a poke only; `None` where the recording has a gap.
    pub fn at(&self, at_s: f64, poke: usize) -> Option<Driving> {
        let Poke { start_s, end_s, direction, .. } = self.recording.pokes[poke];
        let mut driving = match (self.driven, &self.recording.stage) {
            (Driven::ByStage, Some(stage)) => {
                let d = Vec3::from(self.rows.at(&stage.displacement_m, at_s, start_s, end_s)?);
                let before = stage.time_s.partition_point(|&t| t <= at_s).checked_sub(1);
                let deepest = before.map_or(0.0, |i| self.deepest_m[i]);
                self.lifts[poke].driving(&d, deepest, self.noise.stage_m, &direction)
            }
            _ => {
                let wrench = &self.recording.wrench;
                let f = self.rows.at(&wrench.force_n, at_s, start_s, end_s)?;
                let m = self.rows.at(&wrench.torque_nm, at_s, start_s, end_s)?;
                let mut x = Drive::zeros();
                x.fixed_rows_mut::<3>(0).copy_from_slice(&f);
                x.fixed_rows_mut::<3>(3).copy_from_slice(&m);
                let mut variance = Drive::zeros();
                for i in 0..3 {
                    variance[i] = self.noise.force_n[i].powi(2);
                    variance[3 + i] = self.noise.torque_nm[i].powi(2);
                }
                Driving { x, noise: DriveNoise::from_diagonal(&variance), depth_m: 0.0 }
            }
        };
        driving.x[WEIGHT] = self.weight;
        Some(driving)
    }
}

/// Fewer rest rows than this say too little about the noise to contradict the operator.
const REST_ROWS: usize = 20;

/// The noise to weigh with: the stated one, or, where the rest interval contradicts it beyond chance (its variance
/// off by more than four standard errors), the measured one.
fn measured_noise(recording: &Recording, rest: &[(Vec3, usize)]) -> (Noise, [f64; 2]) {
    let mut noise = recording.noise;
    let still = Rows::new(&recording.wrench.time_s).within(f64::NEG_INFINITY, recording.rest_until_s);
    let mut ratio = [1.0; 2];
    let rows = still.len();
    if rows >= REST_ROWS {
        let n = rows as f64;
        let mut pooled = 0.0;
        for axis in 0..3 {
            let column = || recording.wrench.force_n[still.clone()].iter().map(|f| f[axis]);
            let mean = column().sum::<f64>() / n;
            let variance = column().map(|f| (f - mean).powi(2)).sum::<f64>() / (n - 1.0);
            pooled += variance / noise.force_n[axis].powi(2) / 3.0;
            noise.force_n[axis] = trusted(noise.force_n[axis], variance, n - 1.0);
        }
        ratio[0] = pooled.sqrt();
    }
    let mut squares = Vec3::zeros();
    let mut freedom = 0.0;
    for row in &recording.markers.rows {
        if recording.markers.frame_time_s[row.frame as usize] >= recording.rest_until_s {
            break;
        }
        let d = Vec3::from(row.position_m) - rest[row.marker as usize].0;
        squares += d.component_mul(&d);
        freedom += 1.0;
    }
    freedom -= rest.iter().filter(|(_, n)| *n > 0).count() as f64;
    if freedom >= REST_ROWS as f64 {
        let mut pooled = 0.0;
        for axis in 0..3 {
            let variance = squares[axis] / freedom;
            pooled += variance / noise.marker_m[axis].powi(2) / 3.0;
            noise.marker_m[axis] = trusted(noise.marker_m[axis], variance, freedom);
        }
        ratio[1] = pooled.sqrt();
    }
    (noise, ratio)
}

fn trusted(stated: f64, variance: f64, freedom: f64) -> f64 {
    let contradicted = (variance / (stated * stated) - 1.0).abs() > 4.0 * (2.0 / freedom).sqrt();
    // A channel that reads the same at rest up to rounding was set, not measured.
    if contradicted && variance > (1e-3 * stated).powi(2) { variance.sqrt() } else { stated }
}

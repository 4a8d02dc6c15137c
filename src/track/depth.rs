//! How far away a dot is, read from the ring around it: depth, normal, and how well they are known.
//!
//! The edge of a dot disturbs a structured-light camera and a white dot may saturate it, so the dot itself is not asked. On a plane 1/z is
//! an affine function of the normalised image coordinates, 1/z = α + βx + γy, whatever the tilt: with the normal n, β : γ : α = n. Holes
//! are left out. A plane through medians of eight sectors that most sectors agree with (least median of squares, Rousseeuw 1984, over all
//! triples) tells what lies on it; Tukey's biweight does the rest. Nothing is averaged across a jump.

use super::{Camera, DepthSettings, DepthView, Dot};
use crate::geometry::Vec3;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// The plane around a dot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceAtDot {
    /// Depth at the dot's centre, along the optical axis (m).
    pub depth_m: f64,
    /// Standard deviation of that depth (m).
    pub depth_std_m: f64,
    /// Unit normal, towards the camera (camera frame).
    pub normal: Vec3,
    /// Share of the ring's pixels that have a depth.
    pub valid: f64,
    /// Share of those that lie on the plane.
    pub agreeing: f64,
    /// Robust standard deviation of the depths about the plane (m).
    pub residual_m: f64,
    /// 1/z = α + βx + γy (1/m).
    pub(super) plane: Vector3<f64>,
}

/// Why there is no depth at a dot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoDepth {
    /// There was no depth picture.
    NoPicture,
    /// The ring leaves the picture.
    AtBorder,
    /// Too few of the ring's pixels have a depth.
    Holes {
        /// Share that has.
        valid: f64,
    },
    /// No one plane holds most of the ring: a step runs through it.
    Jump {
        /// Share that lies on the best plane.
        agreeing: f64,
    },
    /// What lies on the plane does not surround the dot.
    OneSided {
        /// Sectors of eight that agree.
        sectors: usize,
    },
    /// The plane is seen far more from the side than the dot is: it leans from one surface to another.
    Leaning {
        /// Cosine of the angle between the plane's normal and the view.
        facing: f64,
        /// Shortest over longest diameter of the dot, which is that cosine for a round dot on the plane.
        aspect: f64,
    },
    /// Depths scatter too much about their plane.
    Rough {
        /// Robust standard deviation (m).
        residual_m: f64,
    },
    /// The plane is behind the camera, or seen edge-on.
    Impossible,
}

const SECTORS: usize = 8;
/// Sectors that must agree, and how many in a row may fail, for the dot to be surrounded.
const LEAST_SECTORS: usize = 5;
const MOST_MISSING: usize = 2;
/// Share of a sector's pixels that must be there for its median to count, and agree for it to agree.
const SECTOR_SHARE: f64 = 0.3;
/// By so much a dot's aspect may exceed what it should be on the plane: paint is ragged.
const LEAN: f64 = 0.3;
/// Tukey's constant: 95 % efficiency for normal errors.
const TUKEY: f64 = 4.685;
const STEPS: usize = 3;
/// Readings that a robust scale is taken from.
const ENOUGH: usize = 150;
/// Median absolute deviation to standard deviation.
const MAD: f64 = 1.4826;

/// One depth on the ring: place from the dot's centre in normalised coordinates, and 1/z.
#[derive(Clone, Copy)]
struct Reading {
    at: Vector2<f64>,
    inverse: f64,
    sector: usize,
}

/// Reads depths, one dot after another, reusing memory.
#[derive(Default)]
pub(super) struct DepthReader {
    readings: Vec<Reading>,
    sectors: [Vec<f64>; SECTORS],
    scratch: Vec<f64>,
}

impl DepthReader {
    /// The plane around a dot. `others` are dots near it, whose own pixels are left out.
    pub(super) fn read(
        &mut self,
        view: &DepthView<'_>,
        camera: &Camera,
        dot: &Dot,
        others: &[Dot],
        settings: &DepthSettings,
    ) -> Result<SurfaceAtDot, NoDepth> {
        let centre = camera.undistort(dot.centre_px).ok_or(NoDepth::Impossible)?;
        let to_ray = camera.pixel_jacobian(centre).try_inverse().ok_or(NoDepth::Impossible)?;
        let (asked, per_sector) = self.gather(view, camera, dot, others, settings, &to_ray)?;
        let valid = self.readings.len() as f64 / asked.max(1) as f64;
        if self.readings.len() < 2 * SECTORS || valid < settings.least_valid {
            return Err(NoDepth::Holes { valid });
        }
        let start = self.start(&per_sector).ok_or(NoDepth::Holes { valid })?;
        // Rounding to whole units: du = unit/z² in 1/z.
        let rounding = view.metres_per_unit() * start[0] * start[0] / 12.0_f64.sqrt();
        let (plane, scale) = self.polish(start, rounding).ok_or(NoDepth::Impossible)?;
        if plane[0] <= 0.0 {
            return Err(NoDepth::Impossible);
        }
        let depth_m = 1.0 / plane[0];
        let residual_m = scale * depth_m * depth_m;
        let (agreeing, sectors) = self.agreement(&plane, scale, &per_sector);
        if agreeing < settings.least_agreeing {
            return Err(NoDepth::Jump { agreeing });
        }
        let count = sectors.iter().filter(|&&s| s).count();
        if count < LEAST_SECTORS || longest_gap(&sectors) > MOST_MISSING {
            return Err(NoDepth::OneSided { sectors: count });
        }
        if residual_m > settings.most_rough_m {
            return Err(NoDepth::Rough { residual_m });
        }
        let variance = self.variance(&plane, scale).ok_or(NoDepth::Impossible)?;
        // From the dot's centre as origin to that of the camera: α = a − βx₀ − γy₀.
        let slopes = Vector2::new(plane[1], plane[2]);
        let absolute = Vector3::new(plane[0] - slopes.dot(&centre), slopes.x, slopes.y);
        let mut normal = Vec3::new(absolute.y, absolute.z, absolute.x);
        let ray = Vec3::new(centre.x, centre.y, 1.0);
        if normal.dot(&ray) > 0.0 {
            normal = -normal;
        }
        let normal = normal.try_normalize(1e-12).ok_or(NoDepth::Impossible)?;
        let (facing, aspect) = (-normal.dot(&ray.normalize()), dot.aspect());
        if facing < aspect - LEAN {
            return Err(NoDepth::Leaning { facing, aspect });
        }
        let depth_std_m = variance.sqrt() * depth_m * depth_m;
        Ok(SurfaceAtDot { depth_m, depth_std_m, normal, valid, agreeing, residual_m, plane: absolute })
    }

    /// Fills the readings; gives how many pixels the ring has, in all and by sector.
    fn gather(
        &mut self,
        view: &DepthView<'_>,
        camera: &Camera,
        dot: &Dot,
        others: &[Dot],
        settings: &DepthSettings,
        to_ray: &Matrix2<f64>,
    ) -> Result<(usize, [usize; SECTORS]), NoDepth> {
        self.readings.clear();
        let [inner, outer] = settings.ring;
        let to_circle = dot.rim_px.try_inverse().ok_or(NoDepth::Impossible)?;
        let reach = [dot.rim_px.row(0).norm() * outer, dot.rim_px.row(1).norm() * outer];
        let centre = Vector2::from(dot.centre_px);
        if !camera.sees([centre.x - reach[0], centre.y - reach[1]], 0.0)
            || !camera.sees([centre.x + reach[0], centre.y + reach[1]], 0.0)
        {
            return Err(NoDepth::AtBorder);
        }
        // The disturbed rim is at least a pixel wide, however small the dot.
        let inner = inner.max(1.0 + 1.5 / dot.radius_px());
        let strangers: Vec<(Vector2<f64>, Matrix2<f64>)> = others
            .iter()
            .filter(|o| o.distance_px(dot) <= outer * dot.longest_px() + inner * o.longest_px())
            .filter_map(|o| Some((Vector2::from(o.centre_px), o.rim_px.try_inverse()?)))
            .filter(|(c, _)| *c != centre)
            .collect();
        let (mut asked, mut per_sector) = (0, [0; SECTORS]);
        let unit = view.metres_per_unit();
        for y in (centre.y - reach[1]).ceil() as usize..=(centre.y + reach[1]) as usize {
            let row = view.row(y);
            let (left, right) = ((centre.x - reach[0]).ceil() as usize, (centre.x + reach[0]) as usize);
            for (x, &units) in row.iter().enumerate().take(right + 1).skip(left) {
                let offset = Vector2::new(x as f64, y as f64) - centre;
                let on_circle = to_circle * offset;
                let square = on_circle.norm_squared();
                if square < inner * inner || square > outer * outer {
                    continue;
                }
                let foreign = |(c, a): &(Vector2<f64>, Matrix2<f64>)| {
                    (a * (offset + centre - c)).norm_squared() < inner * inner
                };
                if strangers.iter().any(foreign) {
                    continue;
                }
                let sector = sector(on_circle);
                asked += 1;
                per_sector[sector] += 1;
                if units > 0 {
                    let inverse = 1.0 / (f64::from(units) * unit);
                    self.readings.push(Reading { at: to_ray * offset, inverse, sector });
                }
            }
        }
        Ok((asked, per_sector))
    }

    /// The plane through three sectors' medians that the median sector is nearest to.
    fn start(&mut self, per_sector: &[usize; SECTORS]) -> Option<Vector3<f64>> {
        for list in &mut self.sectors {
            list.clear();
        }
        let mut places = [Vector2::zeros(); SECTORS];
        for reading in &self.readings {
            self.sectors[reading.sector].push(reading.inverse);
            places[reading.sector] += reading.at;
        }
        let mut middles: Vec<(Vector2<f64>, f64)> = Vec::with_capacity(SECTORS);
        for ((list, place), &asked) in self.sectors.iter_mut().zip(places).zip(per_sector) {
            let count = list.len();
            if count >= 3 && count as f64 >= SECTOR_SHARE * asked as f64 {
                middles.push((place / count as f64, median(list)));
            }
        }
        let mut best: Option<(f64, Vector3<f64>)> = None;
        for i in 0..middles.len() {
            for j in i + 1..middles.len() {
                for k in j + 1..middles.len() {
                    let Some(plane) = through([middles[i], middles[j], middles[k]]) else { continue };
                    let mut off = [f64::INFINITY; SECTORS];
                    for (off, (at, v)) in off.iter_mut().zip(&middles) {
                        *off = (v - value(&plane, at)).abs();
                    }
                    off.sort_unstable_by(f64::total_cmp);
                    let off = off[middles.len() / 2];
                    if best.is_none_or(|(least, _)| off < least) {
                        best = Some((off, plane));
                    }
                }
            }
        }
        best.map(|(_, plane)| plane)
    }

    /// Tukey's biweight from a start: the plane, and the robust standard deviation of 1/z about it.
    fn polish(&mut self, start: Vector3<f64>, rounding: f64) -> Option<(Vector3<f64>, f64)> {
        let mut plane = start;
        let mut scale = self.scale(&plane, rounding);
        for _ in 0..STEPS {
            let per_scale = 1.0 / (TUKEY * scale);
            // Sums of weight times (1, x, y, xx, xy, yy) and times the value.
            let (mut n, mut right) = ([0.0; 6], Vector3::zeros());
            for Reading { at, inverse, .. } in &self.readings {
                let t = (inverse - value(&plane, at)) * per_scale;
                let root = (1.0 - t * t).max(0.0);
                let weight = root * root;
                for (sum, term) in n.iter_mut().zip([1.0, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y])
                {
                    *sum += weight * term;
                }
                right += Vector3::new(1.0, at.x, at.y) * (weight * inverse);
            }
            let normal = Matrix3::new(n[0], n[1], n[2], n[1], n[3], n[4], n[2], n[4], n[5]);
            plane = normal.cholesky()?.solve(&right);
        }
        scale = self.scale(&plane, rounding);
        Some((plane, scale))
    }

    fn scale(&mut self, plane: &Vector3<f64>, rounding: f64) -> f64 {
        self.scratch.clear();
        // A hundred and more of them tell the scale to a few per cent.
        let every = (self.readings.len() / ENOUGH).max(1);
        let readings = self.readings.iter().step_by(every);
        self.scratch.extend(readings.map(|r| (r.inverse - value(plane, &r.at)).abs()));
        (MAD * median(&mut self.scratch)).max(rounding)
    }

    /// Share of the readings on the plane, and which sectors are.
    fn agreement(
        &self,
        plane: &Vector3<f64>,
        scale: f64,
        per_sector: &[usize; SECTORS],
    ) -> (f64, [bool; SECTORS]) {
        let mut on = [0_usize; SECTORS];
        for reading in &self.readings {
            if (reading.inverse - value(plane, &reading.at)).abs() < TUKEY * scale {
                on[reading.sector] += 1;
            }
        }
        let agreeing = on.iter().sum::<usize>() as f64 / self.readings.len() as f64;
        let enough = |s: usize| on[s] >= 3 && on[s] as f64 >= SECTOR_SHARE * per_sector[s] as f64;
        (agreeing, std::array::from_fn(enough))
    }

    /// Variance of 1/z at the dot's centre.
    ///
    /// Depths beside one another err alike, so that n of them do not tell √n times more. How much less they tell is seen in the means of
    /// the sectors: their scatter about the plane over that of independent readings multiplies the variance, where it is more than one.
    fn variance(&self, plane: &Vector3<f64>, scale: f64) -> Option<f64> {
        let mut normal = Matrix3::zeros();
        let mut sums = [(0.0, 0.0); SECTORS];
        for reading in &self.readings {
            let residual = reading.inverse - value(plane, &reading.at);
            if residual.abs() < TUKEY * scale {
                let row = Vector3::new(1.0, reading.at.x, reading.at.y);
                normal += row * row.transpose();
                sums[reading.sector].0 += residual;
                sums[reading.sector].1 += 1.0;
            }
        }
        let full: Vec<_> = sums.into_iter().filter(|s| s.1 > 0.0).collect();
        let freedom = full.len() as f64 - 3.0;
        let scatter: f64 = full.iter().map(|(sum, n)| sum * sum / n).sum::<f64>() / (scale * scale);
        let inflation = if freedom > 0.0 { (scatter / freedom).max(1.0) } else { 1.0 };
        let inverse = normal.try_inverse()?;
        Some(inverse[(0, 0)] * scale * scale * inflation)
    }
}

fn value(plane: &Vector3<f64>, at: &Vector2<f64>) -> f64 {
    plane[0] + plane[1] * at.x + plane[2] * at.y
}

fn through([(a, at_a), (b, at_b), (c, at_c)]: [(Vector2<f64>, f64); 3]) -> Option<Vector3<f64>> {
    let (ab, ac) = (b - a, c - a);
    let area = ab.perp(&ac);
    // Three sectors side by side hold the plane up badly.
    let spread = a.amax().max(b.amax()).max(c.amax());
    if area.abs() < 0.3 * spread * spread {
        return None;
    }
    let (to_b, to_c) = (at_b - at_a, at_c - at_a);
    let slopes = Vector2::new(to_b * ac.y - to_c * ab.y, to_c * ab.x - to_b * ac.x) / area;
    Some(Vector3::new(at_a - slopes.dot(&a), slopes.x, slopes.y))
}

/// Octant of a direction, counted once round.
fn sector(at: Vector2<f64>) -> usize {
    let quadrant = match (at.x >= 0.0, at.y >= 0.0) {
        (true, true) => 0,
        (false, true) => 1,
        (false, false) => 2,
        (true, false) => 3,
    };
    // Going round, |y| grows in the even quadrants and |x| in the odd ones.
    let second = (at.y.abs() > at.x.abs()) == (quadrant % 2 == 0);
    2 * quadrant + usize::from(second)
}

fn longest_gap(sectors: &[bool; SECTORS]) -> usize {
    let (mut longest, mut run) = (0, 0);
    // Twice round, for the gap may lie across the end.
    for &there in sectors.iter().chain(sectors) {
        run = if there { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest.min(SECTORS)
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

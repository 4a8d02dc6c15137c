//! A tip on the surface: how far it is moved → with which forces it acts on the body.
//!
//! The tip acts on the body through its ports, discs on the surface; what the body does to a force on a port, with
//! its restraint, is all that the tip needs to know of it (`C`, for a unit modulus). A body of modulus `E` under the
//! same displacement answers `E` times the forces.
//!
//! - *Bonded* pad and flat face: linear in the displacement.
//! - *Unilateral*: without friction, so that only the depth along the normal counts, to first order in the
//!   displacement; pressure or gap, never both nor pull. A pad's traction stays uniform. A flat face's force is
//!   proportional to the depth, also where a part of the face lifts off; a sphere's contact grows with the depth.
//! - *Bonded sphere*: the surface sticks where the sphere has touched it, so that every further bit of displacement
//!   moves the part in contact as a rigid face. The contact is a disc that grows in the middle of the tip while the
//!   tip is moved on straight; on the way back it keeps its size, and the sphere pulls.
//!
//! The rotation of a flat face or of the part that sticks to a sphere is held at zero. Only where the surface under it
//! is not flat, a bonded face is left free to turn, its traction in the one shape of [`Spot::rigid_disc`].

use super::cells::Cells;
use super::complementarity::Touching;
use super::element::gauss_legendre;
use super::error::FemError;
use super::model::Response;
use super::ports::{PORTS, Ports};
use super::rigid_face::RigidFace;
use super::space::Space;
use super::sphere;
use super::spot::Spot;
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, SVector, Vector6};
use std::sync::Arc;

/// Face of a tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TipFace {
    /// Soft: uniform traction, the mean displacement is prescribed.
    Pad,
    /// Rigid and flat.
    Flat,
    /// Rigid and spherical.
    Sphere {
        /// Radius of the sphere (m).
        radius_m: f64,
    },
}

/// A tip at one place.
#[derive(Debug, Clone)]
pub struct Tip {
    nu: f64,
    /// Unit normal into the body.
    inward: Vec3,
    face: TipFace,
    bonded: bool,
    radius: f64,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    /// One port that reads what the tip prescribes.
    Pad(Vec<Spot>),
    Flat {
        ports: Ports,
        face: Box<RigidFace>,
        cells: Option<Arc<Cells>>,
    },
    Sphere {
        ports: Ports,
        sphere: f64,
        cells: Option<Arc<Cells>>,
    },
}

/// What a pressed tip does, for a unit modulus.
#[derive(Debug, Clone)]
pub struct Pressed {
    /// Forces on the ports, three components each in the phantom frame (N/Pa).
    pub forces: DVector<f64>,
    /// Change of the forces as the tip is moved on: `3 ports × 3` (N/Pa/m).
    pub by_displacement: DMatrix<f64>,
    /// Forces on the ports that take a small displacement of the ports back: `3 ports × 3 ports`, symmetric to the
    /// elements' accuracy.
    pub tangent: DMatrix<f64>,
    /// Radius (m) of a disc of the area in contact.
    pub contact_radius_m: f64,
    history: Option<History>,
}

/// How a bonded sphere came to where it is.
#[derive(Debug, Clone)]
struct History {
    steps: Vec<Step>,
    last: Step,
    /// Depth (m) after the contact had reached the tip's rim.
    beyond: f64,
}

/// A growing contact at one radius.
#[derive(Debug, Clone)]
struct Step {
    /// Width of the interval of radii that it stands for (m).
    width: f64,
    face: RigidFace,
    stiffness: Matrix6<f64>,
    /// Motion of the face per unit of depth.
    motion: Vector6<f64>,
    /// Depth per unit of contact radius.
    rate: f64,
}

/// Points along the radius for a growing contact: what is integrated is nearly a polynomial.
const STEPS: usize = 8;
/// Cells reach this much farther than the contact.
const MARGIN: f64 = 1.0 / 0.9;
/// Largest contact of a sphere, over its radius: beyond, its side is steep.
const STEEP: f64 = 0.95;

impl Tip {
    /// A tip of `radius` (m) at the point of the faces `on` nearest to `centre`. A sphere's contact goes no farther
    /// than `radius`.
    ///
    /// # Errors
    /// [`FemError::TipNotFlat`] for a rigid tip, but for a bonded flat one, where the surface under it is not flat or
    /// ends;
    /// [`FemError::DiscOffSurface`] where there is no surface.
    pub fn new(
        space: &Space,
        on: &[usize],
        centre: &Vec3,
        radius: f64,
        face: TipFace,
        bonded: bool,
        poisson_ratio: f64,
    ) -> Result<Self, FemError> {
        let cells = (!bonded && face != TipFace::Pad).then(|| Arc::new(Cells::new()));
        Self::with(space, on, centre, radius, face, cells, bonded, poisson_ratio)
    }

    /// A tip of the same kind elsewhere; cheaper than a new one.
    ///
    /// # Errors
    /// As [`Tip::new`].
    pub fn elsewhere(
        &self,
        space: &Space,
        on: &[usize],
        centre: &Vec3,
        radius: f64,
    ) -> Result<Self, FemError> {
        let cells = match &self.kind {
            Kind::Pad(_) => None,
            Kind::Flat { cells, .. } | Kind::Sphere { cells, .. } => cells.clone(),
        };
        Self::with(space, on, centre, radius, self.face, cells, self.bonded, self.nu)
    }

    #[expect(clippy::too_many_arguments, reason = "what Tip::new is given, and the cells")]
    fn with(
        space: &Space,
        on: &[usize],
        centre: &Vec3,
        radius: f64,
        face: TipFace,
        cells: Option<Arc<Cells>>,
        bonded: bool,
        nu: f64,
    ) -> Result<Self, FemError> {
        let kind = match face {
            TipFace::Pad => Kind::Pad(vec![Spot::disc(space, on, centre, radius)?]),
            TipFace::Flat => match Ports::new(space, on, centre, radius) {
                Ok(ports) => {
                    let face = Box::new(RigidFace::new(&ports, radius, nu));
                    Kind::Flat { ports, face, cells }
                }
                Err(FemError::TipNotFlat { .. }) if bonded => {
                    Kind::Pad(vec![Spot::rigid_disc(space, on, centre, radius)?])
                }
                Err(refused) => return Err(refused),
            },
            TipFace::Sphere { radius_m } => {
                Kind::Sphere { ports: Ports::new(space, on, centre, radius)?, sphere: radius_m, cells }
            }
        };
        let mut tip = Self { nu, inward: Vec3::zeros(), face, bonded, radius, kind };
        tip.inward = tip.ports()[0].as_disc().map_or_else(Vec3::zeros, |(disc, _)| -disc.normal);
        Ok(tip)
    }

    /// The discs through which the tip acts on the body.
    pub fn ports(&self) -> &[Spot] {
        match &self.kind {
            Kind::Pad(spots) => spots,
            Kind::Flat { ports, .. } | Kind::Sphere { ports, .. } => &ports.spots,
        }
    }

    /// What the ports feel of each other, `3 ports × 3 ports` in the phantom frame, for a unit modulus:
    /// the part that the tip does not carry itself. `responses` are those to forces on the ports.
    pub fn compliance(&self, responses: &[Response]) -> DMatrix<f64> {
        match &self.kind {
            Kind::Pad(spots) => DMatrix::from_column_slice(3, 3, responses[0].at(&spots[0]).as_slice()),
            Kind::Flat { ports, .. } | Kind::Sphere { ports, .. } => ports.remainder(responses),
        }
    }

    /// Unit normal into the body.
    pub fn inward(&self) -> Vec3 {
        self.inward
    }

    /// Radius (m) of the disc whose cells resolve the contact at a displacement (m); the tip's own radius unless it
    /// is a sphere.
    pub fn resolved_radius(&self, compliance: &DMatrix<f64>, displacement: &Vec3) -> Result<f64, FemError> {
        let Kind::Sphere { ports, sphere, cells: Some(cells) } = &self.kind else { return Ok(self.radius) };
        let depth = displacement.dot(&self.inward);
        let widest = self.radius.min(STEEP * sphere);
        if depth <= 0.0 {
            return Ok(widest);
        }
        // The body's own give under the middle of the tip takes its share of the depth.
        let shares = ports.shares(0.0, 0.0);
        let give = (self.normal(compliance) * shares).dot(&shares);
        let asks = |a: f64| sphere::depth(*sphere, a) + give * sphere::force(*sphere, a, self.nu);
        let (mut low, mut high) = (0.0, widest);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            *(if asks(middle) < depth { &mut low } else { &mut high }) = middle;
        }
        let mut radius = (high * MARGIN).min(widest);
        // Where the body turns under the tip, the contact moves aside.
        while radius < widest {
            let found = self.touching(compliance, depth, radius)?;
            let to_the_rim = found.is_some_and(|(t, ..)| t.cells.iter().any(|&c| cells.outermost[c]));
            if !to_the_rim {
                break;
            }
            radius = (radius * MARGIN).min(widest);
        }
        Ok(radius)
    }

    /// The tip moved by `displacement` (m, phantom frame) from where it just touches, against a body of
    /// `compliance` (as [`Tip::compliance`] gives it, restraint taken in).
    ///
    /// # Errors
    /// [`FemError::Contact`] when the compliance is not positive definite.
    pub fn press(&self, compliance: &DMatrix<f64>, displacement: &Vec3) -> Result<Pressed, FemError> {
        let radius = self.resolved_radius(compliance, displacement)?;
        self.press_within(compliance, displacement, radius)
    }

    /// As [`Tip::press`], resolving the contact within `radius` (m): with the radius kept, the answer is a smooth
    /// function of the compliance as long as the same cells touch.
    pub fn press_within(
        &self,
        compliance: &DMatrix<f64>,
        displacement: &Vec3,
        radius: f64,
    ) -> Result<Pressed, FemError> {
        let depth = displacement.dot(&self.inward);
        match &self.kind {
            Kind::Pad(_) if self.bonded => {
                let stiffness = compliance.clone().try_inverse().ok_or(NOT_DEFINITE)?;
                Ok(Pressed {
                    forces: &stiffness * displacement,
                    by_displacement: stiffness.clone(),
                    tangent: stiffness,
                    contact_radius_m: self.radius,
                    history: None,
                })
            }
            Kind::Pad(_) if depth <= 0.0 => Ok(self.apart()),
            Kind::Pad(_) => {
                let give = (self.inward.transpose() * compliance * self.inward)[0];
                if give <= 0.0 {
                    return Err(NOT_DEFINITE);
                }
                let map = self.inward * self.inward.transpose() / give;
                let map = DMatrix::from_column_slice(3, 3, map.as_slice());
                Ok(Pressed {
                    forces: &map * displacement,
                    by_displacement: map.clone(),
                    tangent: map,
                    contact_radius_m: self.radius,
                    history: None,
                })
            }
            Kind::Flat { face, cells: None, .. } => {
                let stiffness = face.stiffness(compliance).ok_or(NOT_DEFINITE)?;
                let by_displacement = face.by_displacement(&stiffness);
                Ok(Pressed {
                    forces: &by_displacement * displacement,
                    by_displacement,
                    tangent: face.tangent(&stiffness),
                    contact_radius_m: self.radius,
                    history: None,
                })
            }
            Kind::Sphere { ports, sphere, cells: None } => {
                self.sticking(ports, *sphere, compliance, displacement)
            }
            Kind::Flat { .. } | Kind::Sphere { .. } => {
                Ok(match self.touching(compliance, depth, radius)? {
                    Some((touching, spread)) => self.smooth(&touching, &spread, radius),
                    None => self.apart(),
                })
            }
        }
    }

    /// A bonded sphere as the rigid face that its contact of `radius` (m) is to a small displacement from where it
    /// is: forces zero, their change with the displacement. Other tips do not change their contact: as pressed.
    ///
    /// # Errors
    /// As [`Tip::press`].
    pub fn stuck(&self, compliance: &DMatrix<f64>, radius: f64) -> Result<Pressed, FemError> {
        let Kind::Sphere { ports, cells: None, .. } = &self.kind else {
            return self.press_within(compliance, &self.inward, radius);
        };
        let face = RigidFace::new(ports, radius.min(self.radius), self.nu);
        let stiffness = face.stiffness(compliance).ok_or(NOT_DEFINITE)?;
        Ok(Pressed {
            by_displacement: face.by_displacement(&stiffness),
            tangent: face.tangent(&stiffness),
            contact_radius_m: radius,
            ..self.apart()
        })
    }

    /// Off the surface.
    fn apart(&self) -> Pressed {
        let n = 3 * self.ports().len();
        Pressed {
            forces: DVector::zeros(n),
            by_displacement: DMatrix::zeros(n, 3),
            tangent: DMatrix::zeros(n, n),
            contact_radius_m: 0.0,
            history: None,
        }
    }

    /// Compliance between the ports along the normal.
    fn normal(&self, compliance: &DMatrix<f64>) -> SMatrix<f64, PORTS, PORTS> {
        SMatrix::from_fn(|i, j| {
            (self.inward.transpose() * compliance.fixed_view::<3, 3>(3 * i, 3 * j) * self.inward)[0]
        })
    }

    /// The cells within `radius` that touch at a depth, and the share of every port in each cell's force
    /// (`ports × cells`); `None` off the surface.
    fn touching(
        &self,
        compliance: &DMatrix<f64>,
        depth: f64,
        radius: f64,
    ) -> Result<Option<(Touching, DMatrix<f64>)>, FemError> {
        let (ports, cells, sphere) = match &self.kind {
            Kind::Flat { ports, cells: Some(cells), .. } => (ports, cells, None),
            Kind::Sphere { ports, cells: Some(cells), sphere } => (ports, cells, Some(*sphere)),
            _ => return Ok(None),
        };
        if depth <= 0.0 {
            return Ok(None);
        }
        let n = cells.points.len();
        let mut spread = DMatrix::zeros(PORTS, n);
        let mut reach = DVector::from_element(n, depth);
        for (c, points) in cells.points.iter().enumerate() {
            for (p, w) in points {
                let (x, y) = (radius * p[0], radius * p[1]);
                let mut column = spread.column_mut(c);
                column += ports.shares(x, y) * *w;
                if let Some(sphere) = sphere {
                    reach[c] -= sphere::recess(sphere, x.hypot(y)) * w;
                }
            }
        }
        let mut all = cells.compliance(radius, self.nu);
        let normal = self.normal(compliance);
        all += spread.transpose() * (normal * &spread);
        let start = match sphere {
            None => vec![true; n],
            // The cells that a contact within the margin covers.
            Some(_) => (0..n).map(|c| within(&cells.points[c], 1.0 / MARGIN)).collect(),
        };
        Ok(Some((Touching::find(&all, &reach, start)?, spread)))
    }

    /// Contact without friction.
    fn smooth(&self, touching: &Touching, spread: &DMatrix<f64>, radius: f64) -> Pressed {
        let spread = spread.select_columns(&touching.cells);
        let count = touching.cells.len();
        let mut changes = DMatrix::from_element(count, PORTS + 1, 1.0);
        changes.columns_mut(0, PORTS).copy_from(&spread.transpose());
        let answers = &spread * touching.respond(&changes);
        let forces = &spread * &touching.force;
        let n = self.inward;
        let mut pressed = self.apart();
        for i in 0..PORTS {
            pressed.forces.fixed_rows_mut::<3>(3 * i).copy_from(&(n * forces[i]));
            let along = n * n.transpose();
            pressed
                .by_displacement
                .fixed_view_mut::<3, 3>(3 * i, 0)
                .copy_from(&(along * answers[(i, PORTS)]));
            for j in 0..PORTS {
                let both = 0.5 * (answers[(i, j)] + answers[(j, i)]);
                pressed.tangent.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&(along * both));
            }
        }
        let cells = match &self.kind {
            Kind::Flat { cells: Some(cells), .. } | Kind::Sphere { cells: Some(cells), .. } => cells,
            _ => return pressed,
        };
        let area: f64 = touching.cells.iter().map(|&c| cells.areas[c]).sum();
        pressed.contact_radius_m = (area / std::f64::consts::PI).sqrt() * radius;
        pressed
    }

    /// A sphere that sticks: rigid faces of growing radius, one after the other.
    fn sticking(
        &self,
        ports: &Ports,
        sphere: f64,
        compliance: &DMatrix<f64>,
        displacement: &Vec3,
    ) -> Result<Pressed, FemError> {
        let depth = displacement.dot(&self.inward);
        if depth <= 0.0 {
            return Ok(self.apart());
        }
        let path = displacement / depth;
        let step = |a: f64, width: f64| {
            let face = RigidFace::new(ports, a, self.nu);
            let stiffness = face.stiffness(compliance).ok_or(NOT_DEFINITE)?;
            let motion = face.motion(&path);
            // The next ring is touched when the half-space under the contact has been pressed on as far as the
            // sphere's side is higher there.
            let local = face.normal_compliance() * (stiffness * motion)[2];
            if local <= 0.0 {
                return Err(FemError::Contact {
                    why: "moved so much more along than into the surface, the sphere does not press",
                    cells: 0,
                    exchanges: 0,
                });
            }
            let rate = sphere::depth_rate(sphere, a) / local;
            Ok(Step { width, face, stiffness, motion, rate })
        };
        let line = gauss_legendre(STEPS);
        let steps_to = |a: f64| line.iter().map(|&(t, w)| step(a * t, a * w)).collect::<Result<Vec<_>, _>>();
        let depth_of = |steps: &[Step]| steps.iter().map(|s| s.width * s.rate).sum::<f64>();
        let widest = self.radius.min(STEEP * sphere);
        let mut a = (sphere * depth).sqrt().min(widest);
        let mut steps = steps_to(a)?;
        let mut beyond = depth - depth_of(&steps);
        for _ in 0..30 {
            if beyond.abs() < 1e-13 * depth || (a == widest && beyond > 0.0) {
                break;
            }
            a = (a + beyond / step(a, 0.0)?.rate).clamp(0.2 * a, widest);
            steps = steps_to(a)?;
            beyond = depth - depth_of(&steps);
        }
        let last = step(a, 0.0)?;
        let beyond = if a == widest { beyond } else { 0.0 };
        let mut sum = last.face.on_ports(&(last.stiffness * last.motion)) * beyond;
        for s in &steps {
            sum += s.face.on_ports(&(s.stiffness * s.motion)) * (s.rate * s.width);
        }
        Ok(Pressed {
            forces: DVector::from_column_slice(sum.as_slice()),
            by_displacement: last.face.by_displacement(&last.stiffness),
            tangent: last.face.tangent(&last.stiffness),
            contact_radius_m: a,
            history: Some(History { steps, last, beyond }),
        })
    }
}

fn within(points: &[([f64; 2], f64)], radius: f64) -> bool {
    points.iter().map(|(p, w)| p[0].hypot(p[1]) * w).sum::<f64>() < radius
}

const NOT_DEFINITE: FemError = FemError::Contact {
    why: "the compliance under the tip is not positive definite",
    cells: 0,
    exchanges: 0,
};

impl Pressed {
    /// Force of the tip (N/Pa).
    pub fn force(&self) -> Vec3 {
        (0..self.forces.len() / 3).map(|i| self.forces.fixed_rows::<3>(3 * i).into_owned()).sum()
    }

    /// Change of the forces with the compliance, the displacement kept, to first order: `−T dC q`, summed up along
    /// the way that a bonded sphere has come.
    pub fn change(&self, compliance: &DMatrix<f64>) -> DVector<f64> {
        let Some(history) = &self.history else { return -(&self.tangent * (compliance * &self.forces)) };
        let last = &history.last;
        let mut sum = SVector::<f64, { 3 * PORTS }>::zeros();
        let mut deeper = 0.0;
        for s in &history.steps {
            let sizes = s.stiffness * s.motion;
            let change = s.face.stiffness_change(&s.stiffness, compliance) * s.motion;
            // A softer answer to the depth makes the contact grow slower.
            let rate = -s.rate * change[2] / sizes[2];
            sum += s.face.on_ports(&(change * s.rate + sizes * rate)) * s.width;
            deeper += rate * s.width;
        }
        let change = last.face.stiffness_change(&last.stiffness, compliance) * last.motion;
        sum += last.face.on_ports(&(change * history.beyond - last.stiffness * last.motion * deeper));
        DVector::from_column_slice(sum.as_slice())
    }

    /// Forces on the ports after the tip has been moved on by `by` (m) with the contact as it is: how a bonded tip
    /// is drawn back.
    pub fn held_and_moved(&self, by: &Vec3) -> DVector<f64> {
        &self.forces + &self.by_displacement * by
    }
}

//! The modulus from load cases, and where another load takes the markers.

use super::super::error::InverseError;
use super::super::result::Estimate;
use super::case::{Case, CaseMarker, DeadLoad};
use super::hung::{Body, Carried, FIXED, State};
use crate::fem::{FemError, Resolution, discretise};
use crate::geometry::Vec3;
use crate::mesh::TetMesh;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What is hung: the body that all load cases share.
#[derive(Debug, Clone, Copy)]
pub struct Hanging<'a> {
    /// Its shape, with what holds it.
    pub mesh: &'a TetMesh,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Range in which the modulus is expected (Pa): where the search begins.
    pub modulus_range_pa: [f64; 2],
}

/// What load cases say.
#[derive(Debug, Clone, PartialEq)]
pub struct Hung {
    /// Young's modulus at small strain (Pa).
    pub young_modulus_pa: Estimate,
    /// Half the width of a 90 % interval over the standard deviation: Student's distribution.
    pub half_width: f64,
    /// What each case says by itself, to first order.
    pub alone: Vec<Alone>,
    /// What is left along x, y and z (m, root mean square, less the degree of freedom that the modulus took).
    pub left_m: [f64; 3],
    /// Independent units: recordings, or, of a single one, its markers.
    pub units: usize,
    /// What the elements may get wrong of the modulus, relative: the step from the given mesh to the one cut finer.
    pub elements: f64,
    /// Unknowns of the finer mesh.
    pub unknowns: usize,
    /// Where every asked load takes its markers.
    pub predicted: Vec<Vec<MarkerAt>>,
}

/// One load case by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Alone {
    /// Name of the recording.
    pub recording: String,
    /// Number of the poke.
    pub poke: u32,
    /// Its modulus (Pa).
    pub young_modulus_pa: f64,
}

/// Where a load takes a marker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerAt {
    /// Number by which the recordings name it.
    pub number: u32,
    /// Rest position (m).
    pub rest: Vec3,
    /// Displacement (m).
    pub moved: Vec3,
    /// Whether it stands on the loaded disc: where it goes then depends on how the load is spread there.
    pub on_load: bool,
    /// Standard deviation along x, y and z (m) of a single measurement: that of the prediction with what is left between recordings.
    pub sd: Vec3,
}

const ITERATIONS: usize = 20;
/// A step of the logarithm of the modulus below this is none.
const AT_REST: f64 = 1e-5;
/// Longest step of that logarithm.
const LONGEST: f64 = 0.5;

/// Finds the modulus that explains `cases`, and where the loads of `asked` take their markers.
///
/// Gauss–Newton on the logarithm of the modulus, each axis weighed by what is left along it; exact sensitivities.
///
/// # Errors
/// [`InverseError::Undetermined`] where nothing moves, [`InverseError::NoEquilibrium`] where a load has none,
/// [`InverseError::NotConverged`].
pub fn hang(
    hanging: &Hanging<'_>,
    cases: &[Case],
    asked: &[Case],
    tell: &mut dyn FnMut(usize),
) -> Result<Hung, InverseError> {
    let given = Body::new(hanging.mesh, hanging.poisson_ratio)?;
    let finer = Body::new(&cut_finer(hanging.mesh)?, hanging.poisson_ratio)?;
    tell(finer.unknowns());
    let [low, high] = hanging.modulus_range_pa;
    let found = Search { body: &finer, cases }.down((low * high).sqrt())?;
    let elements = Search { body: &given, cases }.at(found.modulus, Vec::new())?.step();
    let units = found.units(cases);
    let (variance, half_width) = found.variance(&units)?;
    let sd = variance.sqrt().hypot(elements);
    let spread = Vec3::from(found.left_m);
    let predict = |case: &Case| -> Result<Vec<MarkerAt>, InverseError> {
        let at = |body: &Body, modulus: f64| {
            body.carried(&body.under(&case.load, modulus, None)?, &case.load, &case.markers)
        };
        let coarse_modulus = found.modulus * elements.exp();
        let (coarse, fine) = rayon::join(|| at(&given, coarse_modulus), || at(&finer, found.modulus));
        let (coarse, fine) = (coarse?, fine?);
        let of = |(m, marker): (usize, &CaseMarker)| {
            let by_modulus = fine[m].by_log_modulus * variance.sqrt();
            let by_elements = fine[m].moved - coarse[m].moved;
            MarkerAt {
                number: marker.number,
                rest: marker.rest,
                moved: fine[m].moved,
                on_load: fine[m].on_load,
                sd: Vec3::from_fn(|i, _| by_modulus[i].hypot(by_elements[i]).hypot(spread[i])),
            }
        };
        Ok(case.markers.iter().enumerate().map(of).collect())
    };
    let predicted = asked.iter().map(predict).collect::<Result<_, _>>()?;
    Ok(Hung {
        young_modulus_pa: Estimate { value: found.modulus, sd: sd * found.modulus },
        half_width,
        alone: found.alone(cases),
        left_m: found.left_m,
        units: units.len(),
        elements: elements.abs(),
        unknowns: finer.unknowns(),
        predicted,
    })
}

/// The mesh cut to the first of a fit's resolutions where the hold ends, and to the next where it is as fine as that already.
fn cut_finer(given: &TetMesh) -> Result<TetMesh, FemError> {
    let first = discretise(given, FIXED, &[], &Resolution::of(given, 0)?)?;
    if first.nodes.len() > given.nodes.len() {
        return Ok(first);
    }
    Ok(discretise(given, FIXED, &[], &Resolution::of(given, 1)?)?)
}

/// The search for the modulus on one body.
struct Search<'a> {
    body: &'a Body,
    cases: &'a [Case],
}

/// A body under every load, as far as it is known.
type States = Vec<(DeadLoad, State)>;

/// What is left at one modulus.
struct Found {
    modulus: f64,
    left_m: [f64; 3],
    /// For every case and marker seen: what is left and the derivative by the logarithm of the modulus, over what is left on its axis.
    rows: Vec<Vec<(Vec3, Vec3)>>,
    states: States,
}

impl Search<'_> {
    fn down(&self, start: f64) -> Result<Found, InverseError> {
        let (mut modulus, mut states) = (start, Vec::new());
        let mut promised = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let found = self.at(modulus, states)?;
            let step = found.step().clamp(-LONGEST, LONGEST);
            if step.abs() < AT_REST {
                return Ok(found);
            }
            promised = step * found.normal().0;
            modulus *= step.exp();
            states = found.states;
        }
        Err(InverseError::NotConverged { promised, misfit: f64::NAN })
    }

    /// What is left at a modulus, sought from `before`.
    fn at(&self, modulus: f64, before: States) -> Result<Found, InverseError> {
        let mut states: States = Vec::new();
        for load in self.cases.iter().map(|case| case.load) {
            if !states.iter().any(|(known, _)| *known == load) {
                let from = before.iter().find(|(known, _)| *known == load).map(|(_, state)| &state.at);
                states.push((load, self.body.under(&load, modulus, from)?));
            }
        }
        let mut rows = Vec::new();
        for case in self.cases {
            for (_, state) in states.iter().filter(|(load, _)| *load == case.load) {
                rows.push(left(case, &self.body.carried(state, &case.load, &case.markers)?));
            }
        }
        Found::weighed(modulus, rows, states)
    }
}

/// What is left of every marker seen in a case, and its derivative. Those on the loaded disc are left out: what they do depends on how
/// the load is spread there, which a weight that hangs does not tell.
fn left(case: &Case, carried: &[Carried]) -> Vec<(Vec3, Vec3)> {
    let seen = case.markers.iter().zip(carried).filter(|(_, carried)| !carried.on_load);
    seen.filter_map(|(marker, carried)| Some((marker.moved? - carried.moved, carried.by_log_modulus)))
        .collect()
}

impl Found {
    /// Weighs every axis by what is left along it.
    fn weighed(modulus: f64, mut rows: Vec<Vec<(Vec3, Vec3)>>, states: States) -> Result<Self, InverseError> {
        let all = || rows.iter().flatten();
        let count = all().count() as f64;
        if count < 2.0 {
            return Err(InverseError::Undetermined { why: "fewer than two markers were seen under load" });
        }
        let mean: Vec3 = all().map(|(r, _)| r.component_mul(r)).sum::<Vec3>() / (count - 1.0);
        // An axis along which nothing is left would weigh without end: none is known better than a hundredth of the others.
        let least = 1e-4 * mean.max();
        let left = mean.map(|m| m.max(least).max(f64::MIN_POSITIVE).sqrt());
        for (residual, slope) in rows.iter_mut().flatten() {
            (*residual, *slope) = (residual.component_div(&left), slope.component_div(&left));
        }
        let found = Self { modulus, left_m: left.into(), rows, states };
        match found.normal() {
            (gradient, curvature) if curvature > 0.0 && (gradient / curvature).is_finite() => Ok(found),
            _ => Err(InverseError::Undetermined { why: "no marker moves under these loads" }),
        }
    }

    /// Gauss–Newton's step of the logarithm of the modulus.
    fn step(&self) -> f64 {
        let (gradient, curvature) = self.normal();
        gradient / curvature
    }

    fn normal(&self) -> (f64, f64) {
        normal(self.rows.iter().flatten())
    }

    /// Rows by independent unit.
    fn units(&self, cases: &[Case]) -> Vec<Vec<(Vec3, Vec3)>> {
        let mut names: Vec<&str> = Vec::new();
        let mut units: Vec<Vec<(Vec3, Vec3)>> = Vec::new();
        for (case, rows) in cases.iter().zip(&self.rows) {
            match names.iter().position(|name| *name == case.recording) {
                Some(at) => units[at].extend(rows),
                None => {
                    names.push(&case.recording);
                    units.push(rows.clone());
                }
            }
        }
        if units.len() > 1 { units } else { units.into_iter().flatten().map(|row| vec![row]).collect() }
    }

    /// Variance of the logarithm of the modulus, and half the width of a 90 % interval over its root.
    fn variance(&self, units: &[Vec<(Vec3, Vec3)>]) -> Result<(f64, f64), InverseError> {
        let (_, curvature) = self.normal();
        let free = (units.len() - 1) as f64;
        let between: f64 = units.iter().map(|unit| normal(unit.iter()).0.powi(2)).sum();
        let variance = between / curvature.powi(2) * units.len() as f64 / free;
        let student = StudentsT::new(0.0, 1.0, free)
            .map_err(|_| InverseError::Undetermined { why: "a single marker cannot say how surely" })?;
        Ok((variance, student.inverse_cdf(0.95)))
    }

    fn alone(&self, cases: &[Case]) -> Vec<Alone> {
        let by_itself = |rows: &Vec<(Vec3, Vec3)>| {
            let (gradient, curvature) = normal(rows.iter());
            self.modulus * if curvature > 0.0 { (gradient / curvature).exp() } else { f64::NAN }
        };
        (cases.iter().zip(&self.rows))
            .map(|(case, rows)| Alone {
                recording: case.recording.clone(),
                poke: case.poke,
                young_modulus_pa: by_itself(rows),
            })
            .collect()
    }
}

fn normal<'r>(rows: impl Iterator<Item = &'r (Vec3, Vec3)>) -> (f64, f64) {
    rows.fold((0.0, 0.0), |(g, c), (residual, slope)| (g + residual.dot(slope), c + slope.norm_squared()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Block, block};

    const LENGTH_M: f64 = 0.12;
    const SIDE_M: f64 = 0.01;
    const MODULUS_PA: f64 = 2e5;

    /// A slender bar held at x = 0, a load across its end, and the two markers beside it.
    fn bar() -> TetMesh {
        let mut mesh =
            block(&Block { size_m: [LENGTH_M, SIDE_M, SIDE_M], cells: [16, 2, 2] }).expect("a block");
        for (name, side) in [("fixed", "x-"), ("observed", "x+")] {
            let faces = mesh.surface(side).to_vec();
            mesh.surfaces.insert(name.to_owned(), faces);
        }
        mesh
    }

    /// An end load P with P L² / (E I) = `size` takes the end of an elastica by these shares of the length, down and back.
    fn case(recording: &str, size: f64, down: f64, back: f64) -> Case {
        let bending = MODULUS_PA * SIDE_M.powi(4) / 12.0;
        let load = DeadLoad {
            force_n: Vec3::new(0.0, 0.0, -size * bending / LENGTH_M.powi(2)),
            torque_nm: Vec3::zeros(),
            site: Vec3::new(LENGTH_M, 0.5 * SIDE_M, 0.5 * SIDE_M),
            direction: -Vec3::x(),
            radius_m: 0.003,
            weight_n_m3: Vec3::zeros(),
        };
        let marker = |number: u32, y: f64| CaseMarker {
            number,
            rest: Vec3::new(LENGTH_M, y, 0.5 * SIDE_M),
            moved: Some(Vec3::new(-back, 0.0, -down) * LENGTH_M),
        };
        Case {
            recording: recording.to_owned(),
            poke: 1,
            load,
            markers: vec![marker(1, 0.001), marker(2, 0.009)],
        }
    }

    /// The end of an elastica under a dead load (Bisshopp and Drucker 1945): for P L²/(E I) = 1 and 2 it goes down by 0.30172 and
    /// 0.49346 of the length, and back by 0.05643 and 0.16064. From one come the modulus and the other; a bar twelve times as long as
    /// thick shears by some 0.3 % more.
    #[test]
    fn a_bar_bends_like_the_elastica() {
        let mesh = bar();
        let hanging = Hanging { mesh: &mesh, poisson_ratio: 0.0, modulus_range_pa: [1.5e5, 3e5] };
        let asked = case("two", 2.0, 0.49346, 0.16064);
        let known = [case("one", 1.0, 0.30172, 0.05643)];
        let found =
            hang(&hanging, &known, std::slice::from_ref(&asked), &mut |_| {}).expect("an equilibrium");
        let modulus = found.young_modulus_pa.value;
        assert!((modulus / MODULUS_PA - 1.0).abs() < 0.012, "{modulus}");
        for (marker, at) in asked.markers.iter().zip(&found.predicted[0]) {
            let off = (marker.moved.expect("given") - at.moved) / LENGTH_M;
            assert!(off.x.abs() < 0.002 && off.z.abs() < 0.003 && !at.on_load, "{off}");
        }
        assert_eq!(found.units, 2);
    }

    /// Thirty-five million times the load under which it buckles (Euler: π² E I / 4 L²), from the end along the bar.
    #[test]
    fn a_load_that_the_body_cannot_carry_is_told_with_its_force() {
        let mut load = case("one", 1.0, 0.0, 0.0).load;
        load.force_n = Vec3::new(-1e6, 0.0, 0.0);
        let body = Body::new(&bar(), 0.0).expect("a body");
        let Err(refused) = body.under(&load, MODULUS_PA, None) else {
            panic!("an equilibrium under 1000 kN")
        };
        assert!(matches!(refused, InverseError::NoEquilibrium { .. }), "{refused:?}");
        assert!(refused.to_string().contains("under a force of (-1000000.000, 0.000, 0.000) N"), "{refused}");
    }

    /// A marker on the loaded disc is left out, and one marker alone cannot say how surely.
    #[test]
    fn what_stands_on_the_load_is_left_out() {
        let mesh = bar();
        let hanging = Hanging { mesh: &mesh, poisson_ratio: 0.0, modulus_range_pa: [1.5e5, 3e5] };
        let mut only = case("one", 1.0, 0.30172, 0.05643);
        only.markers[0].rest.y = 0.0051;
        let refused = hang(&hanging, &[only], &[], &mut |_| {}).expect_err("one marker is left");
        assert!(refused.to_string().contains("fewer than two markers"), "{refused}");
    }
}

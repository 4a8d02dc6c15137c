//! One row of the march: the linear system of the tip's force and the displacements of the discs.

use super::dual::{Dual, DualSolver};
use super::effects::{Band, Effects};
use super::march::Group;
use super::slip;
use super::sticky::Sliders;
use crate::geometry::{Vec3, basis_from_axis};
use nalgebra::{DMatrix, DVector};

/// The site where the tip touches, and the unit vector along which it is pressed and the frame gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub site: usize,
    pub direction: Vec3,
}

/// Where the tip touches, and which bands pull.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contact {
    pub at: Option<Spot>,
    pub pulling: Vec<bool>,
}

/// The body with its restraint as a tip feels it where nothing is remembered: discs follow from the tip's force.
pub(super) struct UnderTip<const N: usize> {
    pub at: Spot,
    pub pulling: Vec<bool>,
    /// The tip's path (in units of the modulus) by its force, solved; and what bands' gaps alone add to it.
    held: DualSolver,
    less: DVector<Dual<N>>,
    /// Displacements of the discs by the tip's force, and without.
    discs: DMatrix<Dual<N>>,
    alone: DVector<Dual<N>>,
    /// By a unit of path along each of the tip's axes, where it may let go of some.
    pub by_path: Vec<DVector<Dual<N>>>,
}

impl<const N: usize> UnderTip<N> {
    /// `None` where the restraint alone has no answer.
    pub(super) fn new(
        compliance: &Compliance<N>,
        law: &Law<N>,
        e: Dual<N>,
        tip: &Tip<'_, N>,
        pulling: &[bool],
    ) -> Option<Self> {
        let n = compliance.d.nrows();
        let still = DVector::from_element(n, Dual::from(0.0));
        let matrix = compliance.matrix(law, e, Some(tip));
        let right = compliance.right(law, &still, Some((tip, DVector::from_element(3, Dual::from(0.0)))));
        let solver = DualSolver::new(&matrix.view((3, 3), (n, n)).into_owned())?;
        let mut discs = DMatrix::from_element(n, 3, Dual::from(0.0));
        for i in 0..3 {
            discs.set_column(i, &-solver.solve(&matrix.view((3, i), (n, 1)).column(0).into_owned())?);
        }
        let alone = solver.solve(&right.rows(3, n).into_owned())?;
        let pulled = matrix.view((0, 3), (3, n));
        let path = matrix.view((0, 0), (3, 3)) + pulled * &discs;
        let less = right.rows(0, 3) - pulled * &alone;
        let held = DualSolver::new(&path)?;
        let by_path = tip.paths(e).into_iter().map(|path| Some(both(&held.solve(&path)?, |q| &discs * q)));
        let by_path = by_path.collect::<Option<_>>()?;
        Some(Self { at: tip.at, pulling: pulling.to_vec(), held, less, discs, alone, by_path })
    }

    /// Force of the tip on a `path` on which it holds on, and displacements of the discs.
    pub(super) fn answer(&self, path: &DVector<Dual<N>>) -> Option<DVector<Dual<N>>> {
        let q = self.held.solve(&(path + &self.less))?;
        Some(both(&q, |q| &self.alone + &self.discs * q))
    }
}

/// A force of the tip, then the displacements of the discs.
fn both<const N: usize>(
    q: &DVector<Dual<N>>,
    discs: impl Fn(&DVector<Dual<N>>) -> DVector<Dual<N>>,
) -> DVector<Dual<N>> {
    let u = discs(q);
    DVector::from_iterator(q.len() + u.len(), q.iter().chain(u.iter()).copied())
}

/// `f = −K u + p` on the discs at one row; `K` has one block a disc.
pub(super) struct Law<const N: usize> {
    k: Vec<[[Dual<N>; 3]; 3]>,
    p: DVector<Dual<N>>,
}

impl<const N: usize> Law<N> {
    pub(super) fn new(
        discs: usize,
        groups: &[Group<N>],
        bands: &[Band<N>],
        own: &[(Dual<N>, DVector<Dual<N>>)],
        pulling: &[bool],
        sliders: &[Sliders<N>],
    ) -> Self {
        let mut k = vec![[[Dual::from(0.0); 3]; 3]; discs / 3];
        let mut p = DVector::from_element(discs, Dual::from(0.0));
        let laws = groups.iter().zip(bands).zip(own).zip(pulling).zip(sliders);
        for ((((group, band), (stiffness, past)), pulling), sliders) in laws {
            for (n, disc) in group.discs.clone().enumerate() {
                match &band.slack {
                    None => {
                        let (drags, dragged) = sliders.pull(n);
                        k[disc] = drags;
                        for i in 0..3 {
                            k[disc][i][i] += *stiffness;
                            p[3 * disc + i] = dragged[i] - past[3 * n + i];
                        }
                    }
                    Some(slack) if *pulling => {
                        let past: Dual<N> = (0..3).map(|i| past[3 * n + i] * slack.direction[i]).sum();
                        for i in 0..3 {
                            k[disc][i] = slack.direction.map(|d| *stiffness * (slack.direction[i] * d));
                            p[3 * disc + i] = (*stiffness * slack.gap_m - past) * slack.direction[i];
                        }
                    }
                    Some(_) => {}
                }
            }
        }
        Self { k, p }
    }

    /// `M K` for any matrix with one column a component.
    fn after(&self, m: &DMatrix<Dual<N>>) -> DMatrix<Dual<N>> {
        DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| {
            let (disc, axis) = (j / 3, j % 3);
            (0..3)
                // One that is zero here may not stay so: a slider that turns.
                .filter(|&l| self.k[disc][l][axis].re != 0.0 || self.k[disc][l][axis].eps.0.is_some())
                .map(|l| m[(i, 3 * disc + l)] * self.k[disc][l][axis])
                .sum()
        })
    }

    /// Forces at these displacements.
    pub(super) fn forces(&self, u: &DVector<Dual<N>>) -> DVector<Dual<N>> {
        DVector::from_fn(self.p.len(), |i, _| {
            let (disc, axis) = (i / 3, i % 3);
            (0..3).fold(self.p[i], |f, j| f - self.k[disc][axis][j] * u[3 * disc + j])
        })
    }
}

/// The condensed body.
pub(super) struct Compliance<const N: usize> {
    pub a: DMatrix<Dual<N>>,
    pub b: DMatrix<Dual<N>>,
    pub d: DMatrix<Dual<N>>,
}

impl<const N: usize> Compliance<N> {
    /// The system of one row: unknowns are the force of the tip, if it touches, and the discs' displacements.
    pub(super) fn matrix(&self, law: &Law<N>, e: Dual<N>, tip: Option<&Tip<'_, N>>) -> DMatrix<Dual<N>> {
        let (n, first) = (self.d.nrows(), if tip.is_some() { 3 } else { 0 });
        let mut m = DMatrix::from_element(first + n, first + n, Dual::from(0.0));
        m.view_mut((first, first), (n, n)).copy_from(&law.after(&self.d));
        for i in first..first + n {
            m[(i, i)] += e;
        }
        let Some(tip) = tip else { return m };
        let s = 3 * tip.at.site;
        let pull = law.after(&self.b.columns(s, 3).transpose());
        for i in 0..3 {
            for j in 0..3 {
                let give = tip.effects.stage_m_per_n * (tip.at.direction[i] * tip.at.direction[j]);
                m[(i, j)] = self.a[(s + i, s + j)] + e * give;
            }
            for j in 0..n {
                m[(3 + j, i)] = -self.b[(j, s + i)];
                m[(i, 3 + j)] = -pull[(i, j)];
            }
        }
        m
    }

    /// Its right-hand side: `past` under the discs, and the path of the tip in units of the modulus.
    pub(super) fn right(
        &self,
        law: &Law<N>,
        past: &DVector<Dual<N>>,
        path: Option<(&Tip<'_, N>, DVector<Dual<N>>)>,
    ) -> DVector<Dual<N>> {
        // One that is zero here may not stay so: a gap, or what a band has relaxed.
        let pulls = law.p.iter().any(|p| p.re != 0.0 || p.eps.0.is_some());
        let under = if !pulls { -past } else { &self.d * &law.p - past };
        let Some((tip, mut tip_rows)) = path else { return under };
        if pulls {
            tip_rows -= self.b.columns(3 * tip.at.site, 3).transpose() * &law.p;
        }
        let mut right = DVector::from_element(3 + under.len(), Dual::from(0.0));
        right.rows_mut(0, 3).copy_from(&tip_rows);
        right.rows_mut(3, under.len()).copy_from(&under);
        right
    }
}

/// The tip while it touches.
pub(super) struct Tip<'a, const N: usize> {
    pub at: Spot,
    /// Unit normal of the surface, into the phantom.
    pub inward: Vec3,
    pub effects: &'a Effects<N>,
}

impl<const N: usize> Tip<'_, N> {
    /// Two axes in the surface, and the one into it.
    pub(super) fn axes(&self) -> [Vec3; 3] {
        let basis = basis_from_axis(&self.inward);
        [basis.column(0).into_owned(), basis.column(1).into_owned(), self.inward]
    }

    /// A unit of path along each of them, in units of the modulus, where the tip may let go of some.
    pub(super) fn paths(&self, e: Dual<N>) -> Vec<DVector<Dual<N>>> {
        let axes = if self.effects.friction.is_some() { &self.axes()[..] } else { &[] };
        axes.iter().map(|axis| DVector::from_fn(3, |i, _| e * axis[i])).collect()
    }

    /// What a tip that rubs lets go of its path (m), taken off what follows from it: `x`, answers to which by a unit of path are `by_path`.
    /// `None` where no slip obeys friction.
    pub(super) fn rub(&self, x: &mut DVector<Dual<N>>, by_path: &[DVector<Dual<N>>]) -> Option<[Dual<N>; 3]> {
        let mut gone = [Dual::from(0.0); 3];
        let Some(friction) = self.effects.friction else { return Some(gone) };
        let axes = self.axes();
        let along = |x: &DVector<Dual<N>>, axis: &Vec3| -> Dual<N> { (0..3).map(|i| x[i] * axis[i]).sum() };
        let firm = std::array::from_fn(|i| along(x, &axes[i]));
        let stiffness = std::array::from_fn(|i| std::array::from_fn(|j| along(&by_path[j], &axes[i])));
        let slip = slip::let_go(&firm, &stiffness, friction)?;
        for ((slip, axis), by_path) in slip.iter().zip(&axes).zip(by_path) {
            x.axpy(-*slip, by_path, Dual::from(1.0));
            gone.iter_mut().zip(axis.iter()).for_each(|(gone, share)| *gone += *slip * *share);
        }
        Some(gone)
    }

    /// What the frame gives (m).
    pub(super) fn stage_give(&self, q: &[Dual<N>; 3]) -> [Dual<N>; 3] {
        let along: Dual<N> = (0..3).map(|i| q[i] * self.at.direction[i]).sum();
        std::array::from_fn(|i| self.effects.stage_m_per_n * along * self.at.direction[i])
    }
}

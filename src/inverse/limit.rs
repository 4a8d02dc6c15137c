//! The limit of fine elements: the compliance on one moderate discretisation, corrected by two finer ones.
//!
//! Everything that is searched and fitted stands on the first discretisation, where a new place costs little. What
//! that discretisation gets wrong, the extrapolation of the two finer ones (Richardson 1911) less its own word, is
//! added to its compliance, for patches where they stood when the correction was made. Fitting and correcting take
//! turns until neither moves anything (defect correction, Stetter 1978): then the fit is that of the limit.

use super::blocks::{Bench, Blocks};
use super::error::InverseError;
use super::forward::Group;
use super::problem::{Linearised, Problem};
use super::refit::{Descent, GOOD_ENOUGH, descend, settled, where_answered};
use super::restraint::{Mounted, Restraint};
use super::search::pruned;
use crate::fem::Discretisation;
use crate::geometry::Vec3;
use std::ops::Range;

/// A model on one of the finer discretisations.
pub struct Level {
    /// The model with everything observed on it.
    pub bench: Bench,
    /// Faces of its search surface.
    pub search: Vec<usize>,
}

/// Two finer discretisations.
pub struct Finer {
    /// On the coarser.
    pub coarse: Level,
    /// On the finer.
    pub fine: Level,
}

/// What is added to the first discretisation's compliance.
pub struct Correction {
    /// For the limit.
    pub limit: Difference,
    /// For the finest discretisation alone.
    pub finest: Difference,
    /// Where the patches stood that it was made for.
    made_for: Vec<Restraint>,
}

/// A correction still holds when no patch has moved, or grown, by more than this share of its radius: the correction,
/// itself a few per cent, changes over lengths like the radius.
const STILL_HOLDS: f64 = 0.01;

impl Correction {
    /// Whether it may as well have been made for `patches`.
    pub fn holds_for(&self, patches: &[Restraint]) -> bool {
        let alike = |a: &Restraint, b: &Restraint| {
            let within = STILL_HOLDS * a.radius_m;
            a.glued == b.glued
                && (a.centre - b.centre).norm() <= within
                && (a.radius_m - b.radius_m).abs() <= within
        };
        self.made_for.len() == patches.len() && self.made_for.iter().zip(patches).all(|(a, b)| alike(a, b))
    }
}

/// Difference of two compliances, with the patches that it was made for.
pub struct Difference {
    blocks: Blocks,
    patches: Vec<(Vec3, Range<usize>)>,
}

impl Finer {
    /// The correction of `first`, on which `patches` are mounted uncorrected.
    pub fn correction(&self, first: &Mounted, patches: &[Restraint]) -> Result<Correction, InverseError> {
        let blocks =
            |level: &Level| Mounted::new(&level.bench, &level.search, patches).map(|mounted| mounted.blocks);
        let (coarse, fine) = rayon::join(|| blocks(&self.coarse), || blocks(&self.fine));
        let (coarse, fine) = (coarse?, fine?);
        let limit = coarse.zip(&fine, Discretisation::extrapolate);
        let difference = |other: &Blocks| Difference {
            blocks: first.blocks.zip(other, |first, other| other - first),
            patches: patches.iter().zip(&first.groups).map(|(p, g)| (p.centre, g.discs.clone())).collect(),
        };
        let made_for = patches.to_vec();
        Ok(Correction { limit: difference(&limit), finest: difference(&fine), made_for })
    }
}

/// Rounds of correcting and fitting: each leaves a few per cent of the correction's change, so that few are needed.
const ROUNDS: usize = 12;

/// As many are enough where the model is taken to be wrong: it may never settle.
pub(super) const UNRESTED_ROUNDS: usize = 5;

/// Rounds in which the size of the elements' error is estimated anew; later it stays, so that the fit can settle.
const ESTIMATES: usize = 4;

/// Fits and corrects in turns, estimates what the elements get wrong from what is left, and takes out what is not
/// significant then, until nothing changes; or, where the model is wrong, through all rounds.
pub(super) fn settle(
    problem: &mut Problem<'_>,
    finer: Option<&Finer>,
    mut at: Linearised,
) -> Result<Linearised, InverseError> {
    // What a search has left unsettled no fit of what it found settles.
    let searched = at.unsettled;
    let (mut rounds, mut gains) = (0, 0.0);
    let most = if problem.unrested { UNRESTED_ROUNDS } else { ROUNDS };
    while rounds < most {
        rounds += 1;
        if let Some(finer) = finer
            && where_answered(problem.correct(finer, &at.state.patches))?.is_none()
        {
            break;
        }
        at = problem.linearise(&at.state)?;
        problem.whitening = problem.whitening.near(&at.prediction);
        if rounds <= ESTIMATES {
            problem.whitening = problem.whitening.with_likeliest_elements(&at);
        }
        let Descent { at: fitted, gained } = descend(problem, &at.state, GOOD_ENOUGH)?;
        let count = at.state.patches.len();
        let settles = settled(&fitted, gained);
        at = pruned(problem, fitted)?;
        if settles && at.state.patches.len() == count {
            at.unsettled = searched;
            return Ok(at);
        }
        gains = gained;
    }
    if problem.takes_unrested(&at) {
        at.unsettled = Some(gains);
        return Ok(at);
    }
    Err(InverseError::NotSettled { rounds, patches: at.state.patches.len() })
}

/// A patch takes the correction over from one that stood within this many of its radii.
const SAME_PATCH: f64 = 2.0;

impl Difference {
    /// Adds the difference to the blocks of `patches` with their `groups`.
    pub fn add_to(&self, blocks: &mut Blocks, patches: &[Restraint], groups: &[Group]) {
        let from = self.discs_of(patches, groups);
        let known = || from.iter().enumerate().filter_map(|(to, from)| Some((3 * to, 3 * (*from)?)));
        for (site, d) in blocks.sites.iter_mut().zip(&self.blocks.sites) {
            site.tip_tip += &d.tip_tip;
            site.markers_tip += &d.markers_tip;
            site.tip_weight += &d.tip_weight;
            for (to, from) in known() {
                let mut rows = site.discs_tip.rows_mut(to, 3);
                rows += d.discs_tip.rows(from, 3);
            }
        }
        blocks.markers_weight += &self.blocks.markers_weight;
        for (to, from) in known() {
            let mut columns = blocks.markers_discs.columns_mut(to, 3);
            columns += self.blocks.markers_discs.columns(from, 3);
            let mut rows = blocks.discs_weight.rows_mut(to, 3);
            rows += self.blocks.discs_weight.rows(from, 3);
            for (other, other_from) in known() {
                let mut block = blocks.discs_discs.fixed_view_mut::<3, 3>(to, other);
                block += self.blocks.discs_discs.fixed_view::<3, 3>(from, other_from);
            }
        }
    }

    /// For every disc the one whose correction it takes over.
    fn discs_of(&self, patches: &[Restraint], groups: &[Group]) -> Vec<Option<usize>> {
        let mut of = vec![None; groups.last().map_or(0, |g| g.discs.end)];
        let mut taken = vec![false; self.patches.len()];
        for (patch, group) in patches.iter().zip(groups) {
            let nearest = self
                .patches
                .iter()
                .enumerate()
                .filter(|(i, (_, discs))| !taken[*i] && discs.len() == group.discs.len())
                .map(|(i, (centre, discs))| (i, (centre - patch.centre).norm(), discs))
                .filter(|(_, distance, _)| *distance <= SAME_PATCH * patch.radius_m)
                .min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((i, _, discs)) = nearest {
                taken[i] = true;
                for (to, from) in group.discs.clone().zip(discs.clone()) {
                    of[to] = Some(from);
                }
            }
        }
        of
    }
}

#[cfg(test)]
mod tests {
    use super::super::evidence::{Driven, Evidence};
    use super::*;
    use crate::fem::{Model, Order};
    use crate::mesh::{Block, block};
    use crate::observation::Noise;
    use nalgebra::DMatrix;

    /// A correction lends no answer to a model that has none: what it was made for stood elsewhere.
    #[test]
    fn a_model_without_an_answer_is_not_corrected_to_one() {
        let mesh = block(&Block { size_m: [0.1, 0.1, 0.03], cells: [5, 5, 2] }).expect("a block");
        let model = Model::new(&mesh, Order::P1, 0.3, "z-").expect("held");
        let search = model.space().surface("z+").to_vec();
        let bench = Bench::new(model, vec![], vec![], &[], Driven::ByStage, None).expect("a bench");
        let noise = Noise { force_n: [1.0; 3], torque_nm: [1.0; 3], marker_m: [1.0; 3], stage_m: [1.0; 3] };
        let evidence = Evidence::of_sites(Vec::new(), noise);
        let mut problem = Problem::new(&evidence, bench, search, Vec::new(), 0.0).expect("a problem");
        let patch = |softness: f64| Restraint {
            centre: Vec3::new(0.05, 0.05, 0.03),
            radius_m: 0.005,
            softness,
            glued: false,
        };
        let own = problem.mount(&[patch(0.0)]).expect("mounted").blocks.discs_discs.symmetric_eigenvalues();
        // Softer by more than the body under it is stiff, and a correction that makes up for that.
        let (sound, unsound) = ([patch(-0.5 * own.min())], [patch(-2.0 * own.max())]);
        assert!(problem.mount(&unsound).is_ok(), "nothing is asked of a model that is not corrected");
        let difference = || Difference {
            blocks: Blocks {
                sites: Vec::new(),
                markers_discs: DMatrix::zeros(0, 3),
                discs_discs: DMatrix::identity(3, 3) * (9.0 * own.max()),
                markers_weight: DMatrix::zeros(0, 1),
                discs_weight: DMatrix::zeros(3, 1),
            },
            patches: vec![(patch(0.0).centre, 0..3)],
        };
        let made_for = vec![patch(0.0)];
        problem.correction = Some(Correction { limit: difference(), finest: difference(), made_for });
        assert!(problem.mount(&sound).is_ok());
        assert!(where_answered(problem.mount(&unsound)).expect("no other error").is_none());
    }

    /// A correction is made anew for patches that have moved, grown, become glue, come or gone; not for a nudge.
    #[test]
    fn a_correction_holds_where_it_was_made() {
        let none = || Difference { blocks: Blocks::default(), patches: Vec::new() };
        let patch = |x: f64, radius_m: f64, glued: bool| Restraint {
            centre: Vec3::new(x, 0.0, 0.0),
            radius_m,
            softness: 10.0,
            glued,
        };
        let made_for = vec![patch(0.1, 0.005, false)];
        let correction = Correction { limit: none(), finest: none(), made_for };
        assert!(correction.holds_for(&[patch(0.100_04, 0.005_04, false)]));
        assert!(correction.holds_for(&[Restraint { softness: 1.0, ..patch(0.1, 0.005, false) }]));
        for other in [patch(0.100_06, 0.005, false), patch(0.1, 0.005_06, false), patch(0.1, 0.005, true)] {
            assert!(!correction.holds_for(&[other]));
        }
        assert!(!correction.holds_for(&[]));
    }
}

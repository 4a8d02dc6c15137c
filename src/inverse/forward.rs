//! What the model says every reading should be, and how that changes with each parameter.
//!
//! Restraint discs pull with `−k u`. With `D = diag(1/κ)`, `κ = k/E`, they are taken out of the problem:
//! `M = C_DD + D`, and every compliance becomes `C' = C − C_·D M⁻¹ C_D·`. Under a stage displacement `d` the tip
//! presses with `q = H⁻¹ (E d − g)`, `H = C'_tip,tip` and `g` the tip's sag; under a wrench `q` is the wrench.
//! Markers move by `(C'_m,tip q + g'_m) / E`. All of it is linear in the drive: a [`Prediction`].

use super::blocks::Blocks;
use super::evidence::{DRIVE, Drive, Driven, WEIGHT};
use nalgebra::{DMatrix, DVector};

/// Restraint discs that share one stiffness.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Its discs: a range of the blocks' discs.
    pub discs: std::ops::Range<usize>,
    /// Compliance of one disc, `E / k = 1/κ` (m⁻¹); 0 is glue.
    pub softness: f64,
}

/// Linear maps from the drive to force and markers at every site.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// One entry a site.
    pub sites: Vec<SitePrediction>,
}

/// Linear maps of one site.
#[derive(Debug, Clone)]
pub struct SitePrediction {
    /// Force of the tip: `3 × DRIVE`.
    pub force: DMatrix<f64>,
    /// Displacement of all markers: `3 markers × DRIVE`.
    pub markers: DMatrix<f64>,
}

/// Compliance with the restraint taken in.
struct Held {
    tip_tip: DMatrix<f64>,
    markers_tip: DMatrix<f64>,
    tip_weight: DMatrix<f64>,
    markers_weight: DMatrix<f64>,
}

/// A change of parameters.
pub enum Change<'a> {
    /// Of the logarithm of Young's modulus.
    LogModulus,
    /// Of the softness of a group (1/m).
    Softness(usize),
    /// Of the blocks themselves (a disc that moves).
    Blocks(&'a Blocks),
    /// A new disc of vanishing stiffness, per unit of `κ = k/E`: how the tip, the markers and the discs move under
    /// a force on it.
    NewDisc(&'a NewDisc),
}

/// What a candidate disc sees of the rest.
pub struct NewDisc {
    /// Tip of every site under the candidate: `3 × 3` (the candidate's force in columns).
    pub tip: Vec<DMatrix<f64>>,
    /// Candidate under the tip's load modes: `3 × modes`, for every site.
    pub under_tip: Vec<DMatrix<f64>>,
    /// Markers under the candidate: `3 markers × 3`.
    pub markers: DMatrix<f64>,
    /// Discs under the candidate: `3 discs × 3`.
    pub discs: DMatrix<f64>,
    /// Candidate under the body's weight: `3 × 1`.
    pub weight: DMatrix<f64>,
}

/// The forward model: blocks and restraint.
pub struct Forward<'a> {
    /// Compliance blocks.
    pub blocks: &'a Blocks,
    /// Restraint groups.
    pub groups: &'a [Group],
    /// Young's modulus (Pa).
    pub modulus: f64,
    /// What drives the model.
    pub driven: Driven,
    /// `M⁻¹`.
    inverse: DMatrix<f64>,
}

impl<'a> Forward<'a> {
    /// Takes the restraint in. `None` when the compliance of the discs is not positive definite, which a sound
    /// model never gives.
    pub fn new(blocks: &'a Blocks, groups: &'a [Group], modulus: f64, driven: Driven) -> Option<Self> {
        let mut m = blocks.discs_discs.clone();
        for group in groups {
            for i in 3 * group.discs.start..3 * group.discs.end {
                m[(i, i)] += group.softness;
            }
        }
        let inverse = if m.is_empty() { m } else { m.cholesky()?.inverse() };
        Some(Self { blocks, groups, modulus, driven, inverse })
    }

    fn held(&self, site: usize) -> Held {
        let (b, s) = (self.blocks, &self.blocks.sites[site]);
        let pull = &self.inverse * &s.discs_tip;
        let pull_weight = &self.inverse * &b.discs_weight;
        // The tip's own three components of its load modes see the discs by reciprocity.
        let tip_discs = s.discs_tip.columns(0, 3).transpose();
        Held {
            tip_tip: &s.tip_tip - &tip_discs * &pull,
            markers_tip: &s.markers_tip - &b.markers_discs * &pull,
            tip_weight: &s.tip_weight - &tip_discs * &pull_weight,
            markers_weight: &b.markers_weight - &b.markers_discs * &pull_weight,
        }
    }

    /// Change of the held compliance, the modulus kept.
    fn held_change(&self, site: usize, change: &Change<'_>) -> Option<Held> {
        let (b, s) = (self.blocks, &self.blocks.sites[site]);
        let pull = &self.inverse * &s.discs_tip;
        let pull_weight = &self.inverse * &b.discs_weight;
        let tip_discs = s.discs_tip.columns(0, 3).transpose();
        match change {
            Change::LogModulus => None,
            Change::Softness(group) => {
                let group = &self.groups[*group];
                let rows = 3 * group.discs.start..3 * group.discs.end;
                let (start, count) = (rows.start, rows.len());
                // dC' = + C_·D M⁻¹ dM M⁻¹ C_D·, dM = 1 on the group's diagonal.
                let (p, w) = (pull.rows(start, count), pull_weight.rows(start, count));
                let tip = (&self.inverse.rows(start, count) * &tip_discs.transpose()).transpose();
                let markers = &b.markers_discs * self.inverse.columns(start, count);
                Some(Held {
                    tip_tip: &tip * &p,
                    markers_tip: &markers * &p,
                    tip_weight: &tip * &w,
                    markers_weight: &markers * &w,
                })
            }
            Change::Blocks(d) => {
                let ds = &d.sites[site];
                let dtip = ds.discs_tip.columns(0, 3).transpose();
                // d(M⁻¹ C_D·) = M⁻¹ (dC_D· − dC_DD M⁻¹ C_D·)
                let dpull = &self.inverse * (&ds.discs_tip - &d.discs_discs * &pull);
                let dweight = &self.inverse * (&d.discs_weight - &d.discs_discs * &pull_weight);
                Some(Held {
                    tip_tip: -(&dtip * &pull) - &tip_discs * &dpull,
                    markers_tip: -(&d.markers_discs * &pull) - &b.markers_discs * &dpull,
                    tip_weight: -(&dtip * &pull_weight) - &tip_discs * &dweight,
                    markers_weight: -(&d.markers_discs * &pull_weight) - &b.markers_discs * &dweight,
                })
            }
            Change::NewDisc(new) => {
                // Everything the candidate sees is itself held by the discs already there.
                let reach = &self.inverse * &new.discs;
                let tip = &new.tip[site] - &tip_discs * &reach;
                let markers = &new.markers - &b.markers_discs * &reach;
                let under_tip = &new.under_tip[site] - new.discs.transpose() * &pull;
                let weight = &new.weight - new.discs.transpose() * &pull_weight;
                Some(Held {
                    tip_tip: -(&tip * &under_tip),
                    markers_tip: -(&markers * &under_tip),
                    tip_weight: -(&tip * &weight),
                    markers_weight: -(&markers * &weight),
                })
            }
        }
    }

    /// Forces at one instant of a poke: of the tip (its load modes, N or N·m) and of every restraint disc (N).
    pub fn loads(&self, site: usize, drive: &Drive) -> Option<(DVector<f64>, DVector<f64>)> {
        let (b, s) = (self.blocks, &self.blocks.sites[site]);
        let modes = s.tip_tip.ncols();
        let tip = match self.driven {
            Driven::ByWrench => DVector::from_fn(modes, |i, _| drive[i]),
            Driven::ByStage => {
                let held = self.held(site);
                let wanted =
                    drive.fixed_rows::<3>(0) * self.modulus - held.tip_weight.column(0) * drive[WEIGHT];
                let wanted = DVector::from_column_slice(wanted.as_slice());
                held.tip_tip.columns(0, 3).into_owned().lu().solve(&wanted)?
            }
        };
        let discs = -(&self.inverse * (&s.discs_tip * &tip + b.discs_weight.column(0) * drive[WEIGHT]));
        Some((tip, discs))
    }

    /// What every reading should be.
    pub fn predict(&self) -> Option<Prediction> {
        (0..self.blocks.sites.len())
            .map(|site| {
                let held = self.held(site);
                match self.driven {
                    Driven::ByWrench => Some(self.by_wrench(&held)),
                    Driven::ByStage => {
                        let inverse = held.tip_tip.columns(0, 3).into_owned().try_inverse()?;
                        let mut force = DMatrix::zeros(3, DRIVE);
                        let mut markers = DMatrix::zeros(held.markers_tip.nrows(), DRIVE);
                        let carried = &held.markers_tip.columns(0, 3) * &inverse;
                        force.columns_mut(0, 3).copy_from(&(&inverse * self.modulus));
                        force.column_mut(WEIGHT).copy_from(&(-(&inverse * &held.tip_weight)).column(0));
                        let sag = (&held.markers_weight - &carried * &held.tip_weight) / self.modulus;
                        markers.columns_mut(0, 3).copy_from(&carried);
                        markers.column_mut(WEIGHT).copy_from(&sag.column(0));
                        Some(SitePrediction { force, markers })
                    }
                }
            })
            .collect::<Option<Vec<_>>>()
            .map(|sites| Prediction { sites })
    }

    fn by_wrench(&self, held: &Held) -> SitePrediction {
        let mut markers = DMatrix::zeros(held.markers_tip.nrows(), DRIVE);
        let modes = held.markers_tip.ncols();
        markers.columns_mut(0, modes).copy_from(&(&held.markers_tip / self.modulus));
        markers.column_mut(WEIGHT).copy_from(&(&held.markers_weight / self.modulus).column(0));
        SitePrediction { force: DMatrix::zeros(3, DRIVE), markers }
    }

    /// How every reading changes.
    pub fn derivative(&self, change: &Change<'_>) -> Option<Prediction> {
        (0..self.blocks.sites.len())
            .map(|site| {
                let held = self.held(site);
                let moved = self.held_change(site, change);
                match self.driven {
                    Driven::ByWrench => Some(match moved {
                        Some(moved) => self.by_wrench(&moved),
                        None => {
                            let mut p = self.by_wrench(&held);
                            p.markers *= -1.0;
                            p
                        }
                    }),
                    Driven::ByStage => {
                        let h = held.tip_tip.columns(0, 3).into_owned().try_inverse()?;
                        let mut force = DMatrix::zeros(3, DRIVE);
                        let mut markers = DMatrix::zeros(held.markers_tip.nrows(), DRIVE);
                        match moved {
                            None => {
                                let carried = &held.markers_tip.columns(0, 3) * &h;
                                force.columns_mut(0, 3).copy_from(&(&h * self.modulus));
                                let sag =
                                    (&held.markers_weight - &carried * &held.tip_weight) / -self.modulus;
                                markers.column_mut(WEIGHT).copy_from(&sag.column(0));
                            }
                            Some(moved) => {
                                let dh = -(&h * moved.tip_tip.columns(0, 3) * &h);
                                let carried = &held.markers_tip.columns(0, 3) * &h;
                                let dcarried = &moved.markers_tip.columns(0, 3) * &h
                                    + &held.markers_tip.columns(0, 3) * &dh;
                                force.columns_mut(0, 3).copy_from(&(&dh * self.modulus));
                                let dforce = -(&dh * &held.tip_weight + &h * &moved.tip_weight);
                                force.column_mut(WEIGHT).copy_from(&dforce.column(0));
                                let dsag = (&moved.markers_weight
                                    - &dcarried * &held.tip_weight
                                    - &carried * &moved.tip_weight)
                                    / self.modulus;
                                markers.columns_mut(0, 3).copy_from(&dcarried);
                                markers.column_mut(WEIGHT).copy_from(&dsag.column(0));
                            }
                        }
                        Some(SitePrediction { force, markers })
                    }
                }
            })
            .collect::<Option<Vec<_>>>()
            .map(|sites| Prediction { sites })
    }
}

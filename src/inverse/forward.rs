//! What the model says every reading should be, and how that changes with each parameter.
//!
//! Restraint discs pull with `−k u`. With `D = diag(1/κ)`, `κ = k/E`, they are taken out of the problem:
//! `M = C_DD + D`, and every compliance becomes `C' = C − C_·D M⁻¹ C_D·`. Moved by the stage, the tip takes hold of
//! `H = C'_tip,tip` ([`grip`](super::grip)) and acts on its ports with `q = E Q x − T g`, `x` the drive and `g` the
//! ports' sag; under a wrench `q` is the wrench. Markers move by `(C'_m,tip q + g'_m) / E`. All of it is linear in the
//! drive: a [`Prediction`].

use super::blocks::Blocks;
use super::evidence::{DRIVE, Drive, Driven, WEIGHT};
use super::grip;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

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
    /// Tip of every site under the candidate: `3 ports × 3` (the candidate's force in columns).
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
    /// Compliance with the restraint taken in, for every site.
    held: Vec<Held>,
    /// The tips, holding the body; none when the wrench drives the model.
    grips: Vec<grip::Held>,
}

impl<'a> Forward<'a> {
    /// Takes the restraint in. `None` when the compliance of the discs or under a tip is not positive definite, which
    /// a sound model never gives.
    pub fn new(blocks: &'a Blocks, groups: &'a [Group], modulus: f64, driven: Driven) -> Option<Self> {
        let mut m = blocks.discs_discs.clone();
        for group in groups {
            for i in 3 * group.discs.start..3 * group.discs.end {
                m[(i, i)] += group.softness;
            }
        }
        let inverse = if m.is_empty() { m } else { m.cholesky()?.inverse() };
        let mut forward =
            Self { blocks, groups, modulus, driven, inverse, held: Vec::new(), grips: Vec::new() };
        forward.held = (0..blocks.sites.len()).map(|site| forward.hold(site)).collect();
        if driven == Driven::ByStage {
            let sites = blocks.sites.par_iter().zip(&forward.held);
            forward.grips = sites
                .map(|(site, held)| site.grip.as_ref()?.hold(&held.tip_tip).ok())
                .collect::<Option<Vec<_>>>()?;
        }
        Some(forward)
    }

    fn hold(&self, site: usize) -> Held {
        let (b, s) = (self.blocks, &self.blocks.sites[site]);
        let pull = &self.inverse * &s.discs_tip;
        let pull_weight = &self.inverse * &b.discs_weight;
        // The tip's ports see the discs by reciprocity.
        let tip_discs = s.discs_tip.columns(0, s.tip_tip.nrows()).transpose();
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
        let tip_discs = s.discs_tip.columns(0, s.tip_tip.nrows()).transpose();
        match change {
            Change::LogModulus => None,
            Change::Softness(group) => {
                let group = &self.groups[*group];
                let rows = 3 * group.discs.start..3 * group.discs.end;
                let (start, count) = (rows.start, rows.len());
                // dC' = + C_·D M⁻¹ dM M⁻¹ C_D·, dM = 1 on the group's diagonal.
                let (p, w) = (pull.rows(start, count), pull_weight.rows(start, count));
                let tip = (self.inverse.rows(start, count) * &tip_discs.transpose()).transpose();
                let markers = &b.markers_discs * self.inverse.columns(start, count);
                Some(Held {
                    tip_tip: &tip * p,
                    markers_tip: &markers * p,
                    tip_weight: &tip * w,
                    markers_weight: &markers * w,
                })
            }
            Change::Blocks(d) => {
                let ds = &d.sites[site];
                let dtip = ds.discs_tip.columns(0, s.tip_tip.nrows()).transpose();
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
                let held = &self.held[site];
                let grip = &self.grips[site];
                &grip.by_drive * drive * self.modulus
                    - &grip.tangent * held.tip_weight.column(0) * drive[WEIGHT]
            }
        };
        let discs = -(&self.inverse * (&s.discs_tip * &tip + b.discs_weight.column(0) * drive[WEIGHT]));
        Some((tip, discs))
    }

    /// What every reading should be.
    pub fn predict(&self) -> Option<Prediction> {
        (0..self.blocks.sites.len())
            .map(|site| {
                let held = &self.held[site];
                match self.driven {
                    Driven::ByWrench => Some(self.by_wrench(held)),
                    Driven::ByStage => {
                        let grip = &self.grips[site];
                        let sag = &grip.tangent * &held.tip_weight;
                        let mut force = total(&grip.by_drive) * self.modulus;
                        force.column_mut(WEIGHT).copy_from(&-total(&sag).column(0));
                        let mut markers = &held.markers_tip * &grip.by_drive;
                        let sag = (&held.markers_weight - &held.markers_tip * sag) / self.modulus;
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
                let held = &self.held[site];
                let moved = self.held_change(site, change);
                match self.driven {
                    Driven::ByWrench => Some(match moved {
                        Some(moved) => self.by_wrench(&moved),
                        None => {
                            let mut p = self.by_wrench(held);
                            p.markers *= -1.0;
                            p
                        }
                    }),
                    Driven::ByStage => {
                        let grip = &self.grips[site];
                        let sag = &grip.tangent * &held.tip_weight;
                        Some(match moved {
                            None => {
                                let force = total(&grip.by_drive) * self.modulus;
                                let mut markers = DMatrix::zeros(held.markers_tip.nrows(), DRIVE);
                                let sag = (&held.markers_weight - &held.markers_tip * sag) / -self.modulus;
                                markers.column_mut(WEIGHT).copy_from(&sag.column(0));
                                SitePrediction { force, markers }
                            }
                            Some(moved) => {
                                let by_drive = grip.change(&moved.tip_tip);
                                let dsag = grip.tangent_change(&moved.tip_tip) * &held.tip_weight
                                    + &grip.tangent * &moved.tip_weight;
                                let mut force = total(&by_drive) * self.modulus;
                                force.column_mut(WEIGHT).copy_from(&-total(&dsag).column(0));
                                let mut markers =
                                    &moved.markers_tip * &grip.by_drive + &held.markers_tip * by_drive;
                                let dsag = (&moved.markers_weight
                                    - &moved.markers_tip * sag
                                    - &held.markers_tip * dsag)
                                    / self.modulus;
                                markers.column_mut(WEIGHT).copy_from(&dsag.column(0));
                                SitePrediction { force, markers }
                            }
                        })
                    }
                }
            })
            .collect::<Option<Vec<_>>>()
            .map(|sites| Prediction { sites })
    }
}

/// Sum over the ports: `3 × columns`.
fn total(on_ports: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(3, on_ports.ncols(), |i, j| on_ports.column(j).iter().skip(i).step_by(3).sum())
}

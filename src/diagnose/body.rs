//! The phantom as the march in time needs it: compliance between the tip at every site, the restraint discs and the
//! markers, for a unit modulus, with its derivatives by where the patches are.
//!
//! A tip of several ports keeps the shape of its traction: seen from the body it is one port with three components.

use super::bulk::BodyChange;
use super::dual::Field;
use super::error::DiagnoseError;
use crate::inverse::{Bench, Blocks, Driven, Parameter, Settled, SiteBlocks};
use nalgebra::DMatrix;

/// Compliance between everything. Components in the phantom frame.
#[derive(Debug, Clone)]
pub(super) struct Body {
    /// Number of sites.
    pub sites: usize,
    /// Tips under tips (3 sites × 3 sites).
    pub tips_tips: Field,
    /// Discs under tips (3 discs × 3 sites).
    pub discs_tips: Field,
    /// Discs under discs (3 discs × 3 discs).
    pub discs_discs: Field,
    /// Markers under tips (3 markers × 3 sites) and under discs (3 markers × 3 discs), side by side.
    pub markers: Field,
}

impl Body {
    /// The body with its patches shifted by these values of the parameters.
    pub(super) fn at(&self, parameters: &[f64]) -> Self {
        Self {
            sites: self.sites,
            tips_tips: self.tips_tips.at(parameters),
            discs_tips: self.discs_tips.at(parameters),
            discs_discs: self.discs_discs.at(parameters),
            markers: self.markers.at(parameters),
        }
    }
}

impl Body {
    /// Makes the amount of a change a parameter of the body, at 0.
    pub(super) fn open(&mut self, change: &BodyChange, parameter: usize) {
        let own = [&mut self.tips_tips, &mut self.discs_tips, &mut self.discs_discs, &mut self.markers];
        let changes = [&change.tips_tips, &change.discs_tips, &change.discs_discs, &change.markers];
        own.into_iter().zip(changes).for_each(|(own, change)| own.by.push((parameter, change.value.clone())));
    }

    /// Attaches the markers so much (m) before where the camera takes them to be, which is this parameter: `by_place` is
    /// their derivative by where they are.
    pub(super) fn see_beside(&mut self, by_place: &DMatrix<f64>, shift_m: f64, parameter: usize) {
        self.markers.value -= by_place * shift_m;
        self.markers.by.push((parameter, -by_place));
    }

    /// Adds a change of the body, whose knobs are these parameters.
    pub(super) fn add(&mut self, change: &BodyChange, parameter: impl Fn(usize) -> usize) {
        let own = [&mut self.tips_tips, &mut self.discs_tips, &mut self.discs_discs, &mut self.markers];
        let changes = [&change.tips_tips, &change.discs_tips, &change.discs_discs, &change.markers];
        for (own, change) in own.into_iter().zip(changes) {
            own.value += &change.value;
            own.by.extend(change.by.iter().map(|(knob, by)| (parameter(*knob), by.clone())));
        }
    }
}

/// The body of a settled fit; derivatives by the shifts of its patches, numbered by `index_of`.
///
/// # Errors
/// [`DiagnoseError::NoStage`], [`DiagnoseError::TipNotLinear`].
pub(super) fn body(
    settled: &Settled<'_>,
    index_of: &dyn Fn(Parameter) -> Option<usize>,
) -> Result<Body, DiagnoseError> {
    if settled.evidence.driven != Driven::ByStage {
        return Err(DiagnoseError::NoStage);
    }
    let (problem, at) = (settled.problem, settled.at);
    let blocks = &at.mounted.blocks;
    let shapes = Shape::all(blocks)?;
    let plain = |value| Field { value, by: Vec::new() };
    let mut body = Body {
        sites: shapes.len(),
        tips_tips: plain(tips_tips(&problem.bench, &shapes)),
        discs_tips: plain(discs_tips(blocks, &shapes)),
        discs_discs: plain(blocks.discs_discs.clone()),
        markers: plain(markers(blocks, &shapes)),
    };
    for (parameter, change) in problem.changes(&at.state.patches, &at.mounted) {
        let Some(index) = index_of(parameter) else { continue };
        body.discs_tips.by.push((index, discs_tips(&change, &shapes)));
        body.discs_discs.by.push((index, change.discs_discs.clone()));
        body.markers.by.push((index, markers(&change, &shapes)));
    }
    Ok(body)
}

/// Tips under tips, discs under tips, discs under discs and markers, loaded as on the baseline, of any discretisation;
/// a tip under itself as its ports feel it, without what it carries itself.
pub(super) fn of_blocks(bench: &Bench, blocks: &Blocks, shapes: &[Shape]) -> [DMatrix<f64>; 4] {
    let mut tips = tips_tips(bench, shapes);
    for (i, (site, shape)) in blocks.sites.iter().zip(shapes).enumerate() {
        let own = shape.loads.transpose() * &site.tip_tip * &shape.loads;
        tips.view_mut((3 * i, 3 * i), (3, 3)).copy_from(&own);
    }
    [tips, discs_tips(blocks, shapes), blocks.discs_discs.clone(), markers(blocks, shapes)]
}

/// Tips under tips. A tip reads its displacement as it spreads its force, by reciprocity.
fn tips_tips(bench: &Bench, shapes: &[Shape]) -> DMatrix<f64> {
    let n = 3 * shapes.len();
    let mut all = DMatrix::zeros(n, n);
    for (seen, (tip, shape)) in bench.tips.iter().zip(shapes).enumerate() {
        for (loaded, (response, load)) in bench.tip_responses().iter().zip(shapes).enumerate() {
            let block = if seen == loaded {
                shape.compliance.clone()
            } else {
                let mut ports = DMatrix::zeros(3 * tip.ports().len(), response.modes());
                for (p, port) in tip.ports().iter().enumerate() {
                    ports.rows_mut(3 * p, 3).copy_from(&response.at(port));
                }
                shape.loads.transpose() * ports * &load.loads
            };
            all.view_mut((3 * seen, 3 * loaded), (3, 3)).copy_from(&block);
        }
    }
    (&all + all.transpose()) * 0.5
}

fn discs_tips(blocks: &Blocks, shapes: &[Shape]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(blocks.discs_discs.nrows(), 3 * shapes.len());
    for (site, (own, shape)) in blocks.sites.iter().zip(shapes).enumerate() {
        all.columns_mut(3 * site, 3).copy_from(&(&own.discs_tip * &shape.loads));
    }
    all
}

fn markers(blocks: &Blocks, shapes: &[Shape]) -> DMatrix<f64> {
    let discs = blocks.markers_discs.ncols();
    let mut all = DMatrix::zeros(blocks.markers_discs.nrows(), 3 * shapes.len() + discs);
    for (site, (own, shape)) in blocks.sites.iter().zip(shapes).enumerate() {
        all.columns_mut(3 * site, 3).copy_from(&(&own.markers_tip * &shape.loads));
    }
    all.columns_mut(3 * shapes.len(), discs).copy_from(&blocks.markers_discs);
    all
}

/// How a tip spreads a force over its ports.
pub(super) struct Shape {
    /// Load modes for a unit force along each axis: `modes × 3`.
    pub(super) loads: DMatrix<f64>,
    /// Displacement for a unit force, on the body without restraint (3 × 3).
    pub(super) compliance: DMatrix<f64>,
}

impl Shape {
    /// Of all tips.
    pub(super) fn all(blocks: &Blocks) -> Result<Vec<Self>, DiagnoseError> {
        blocks.sites.iter().map(|site| Self::of(site).ok_or(DiagnoseError::TipNotLinear)).collect()
    }

    /// `None` when the tip's force is not in proportion to its displacement.
    fn of(site: &SiteBlocks) -> Option<Self> {
        let by_displacement = site.grip.as_ref()?.by_displacement(&site.tip_tip)?;
        let total = DMatrix::from_fn(3, 3, |i, j| by_displacement.column(j).iter().skip(i).step_by(3).sum());
        let compliance = total.try_inverse()?;
        Some(Self { loads: by_displacement * &compliance, compliance })
    }
}

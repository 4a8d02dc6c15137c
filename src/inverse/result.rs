//! What a fit found, complete enough to be written to `fit.json` and shown on a page.

use super::published::Variant;
use crate::geometry::Vec3;

/// A value with one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// One standard deviation.
    pub sd: f64,
}

/// Which method made a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitMethod {
    /// Joint modulus and sparse restraint from all pokes, weighted by the noise.
    Default,
    /// The two-step method of Xu, Lei and others (2021), in one of its forms.
    Published(Variant),
}

/// What a restraint patch is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PatchKind {
    /// Springs: the patch's total stiffness (N/m), the same along all three axes.
    Springs {
        /// Stiffness (N/m).
        stiffness_n_per_m: Estimate,
    },
    /// Too stiff to be told from glue.
    Glued {
        /// The stiffness is at least this (N/m), at 95 % confidence.
        stiffness_lower_bound_n_per_m: f64,
    },
}

/// One restraint patch found on the search surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// What it is.
    pub kind: PatchKind,
    /// Centre (m).
    pub centroid_m: Vec3,
    /// One standard deviation of the centre along x, y, z (m).
    pub centroid_sd_m: Vec3,
    /// Radius (m).
    pub radius_m: f64,
    /// Whether the radius was estimated or assumed.
    pub radius_estimated: bool,
    /// Cramér–Rao bound of the stiffness's standard deviation (N/m), support known; `None` for glue.
    pub stiffness_bound_n_per_m: Option<f64>,
}

/// What is left between model and recording, over rows inside poke intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Root mean square over marker components (m).
    pub marker_rms_m: f64,
    /// Root mean square over force components (N).
    pub force_rms_n: f64,
    /// Sum of squared residuals over their noise, per degree of freedom.
    pub chi2_per_dof: f64,
    /// What noise alone leaves of it on average: 1, and more where the stage's noise shows, the camera sways or the force's zero wanders.
    pub chi2_per_dof_expected: f64,
    /// The largest `chi2_per_dof` that noise alone, and what shows of the instruments between pokes, leave in 99.9 % of recordings of this size.
    pub chi2_per_dof_limit: f64,
    /// Standard deviation of the noise measured in the rest interval over the stated one: force, then marker.
    pub rest_noise_over_stated: [f64; 2],
}

/// The discretisation that the fit used, and the error estimated to be left in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Discretisation {
    /// `P1` or `P2`.
    pub element: String,
    /// Nodes and tetrahedra of the mesh as given.
    pub given_nodes: usize,
    /// Tetrahedra of the mesh as given.
    pub given_tets: usize,
    /// Degrees of freedom solved for.
    pub degrees_of_freedom: usize,
    /// Estimated relative error of the modulus from discretisation (one standard deviation).
    pub modulus_error: f64,
}

/// One instant of a poke: what the sensor read and what the model says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time (s).
    pub time_s: f64,
    /// Reported tip displacement along the poke's direction (m); zero when no stage was recorded.
    pub depth_m: f64,
    /// Force read (N).
    pub measured_n: [f64; 3],
    /// Force of the model (N).
    pub modelled_n: [f64; 3],
}

/// One marker at a poke's deepest instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerView {
    /// Number by which the recording names it.
    pub number: u32,
    /// Rest position (m).
    pub rest_m: Vec3,
    /// Measured displacement (m).
    pub measured_m: Vec3,
    /// Displacement of the model (m).
    pub modelled_m: Vec3,
}

/// One poke as the page shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct PokeView {
    /// Number by which the recording names it.
    pub number: u32,
    /// Tip centre on the undeformed surface (m).
    pub site_m: Vec3,
    /// Unit vector into the phantom.
    pub direction: Vec3,
    /// Radius of the tip (m).
    pub radius_m: f64,
    /// The instant of the views below (s): the deepest.
    pub deepest_s: f64,
    /// Model displacement at that instant (m) of every node of the given mesh, and, with elements of second order, of the middles of
    /// its edges in the order of the nodes of [`Space`](crate::fem::Space).
    pub node_displacement_m: Vec<Vec3>,
    /// Markers seen at that instant.
    pub markers: Vec<MarkerView>,
    /// Force against time, inside the poke.
    pub samples: Vec<Sample>,
    /// Share of this poke in the sum of squares, per value.
    pub chi2_per_value: f64,
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Name of the recording.
    pub recording: String,
    /// Which method.
    pub method: FitMethod,
    /// Young's modulus (Pa); the deviation includes the estimated discretisation error.
    pub young_modulus_pa: Estimate,
    /// Its 90 % interval (Pa).
    pub young_modulus_interval90_pa: [f64; 2],
    /// Cramér–Rao bound of its standard deviation (Pa), support known, discretisation exact.
    pub young_modulus_bound_pa: f64,
    /// The range that the operator expects it in (Pa).
    pub young_modulus_expected_pa: [f64; 2],
    /// Sum of the stiffness of all spring patches (N/m).
    pub restraint_total_n_per_m: Estimate,
    /// Restraint patches, stiffest first.
    pub patches: Vec<Patch>,
    /// Correlation of the estimates, row by row: modulus first, then the patches' stiffness in order (glued ones
    /// left out).
    pub correlation: Vec<Vec<f64>>,
    /// What is left.
    pub residual: Residual,
    /// The discretisation.
    pub discretisation: Discretisation,
    /// Whether it came to rest; under a model that is wrong it may not.
    pub settled: bool,
    /// What the recording cannot tell, and what a reader should know before trusting the figures: whole
    /// sentences.
    pub remarks: Vec<String>,
    /// One entry a poke.
    pub pokes: Vec<PokeView>,
}

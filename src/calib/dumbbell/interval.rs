//! How surely is the modulus known? Standard uncertainty of E by its parts (JCGM 100:2008), and a 90 % interval.
//!
//! Parts that all specimens share: width of the die, load cell, gauge length, and what the start leaves open (slack or tare). Parts that differ from
//! one to the next (thickness, batch, mounting) show in the scatter s of several specimens; then u² = c(n) s² + Σ shared², with c(n) the
//! variance of a median of n over that of one value (normal order statistics; Harter and Balakrishnan 1996). One specimen has no scatter:
//! an assumed one and the thickness's tolerance stand in. t-quantile with ν = (n − 1) (u²/(c s²))² (Welch and Satterthwaite).

use crate::calib::coverage::half_90;

/// Variance of the median of n standard normal values, n from 1.
const MEDIAN_VARIANCE: [f64; 10] = [1.0, 0.5, 0.4487, 0.2982, 0.2868, 0.2147, 0.2104, 0.1682, 0.1661, 0.1383];

/// What sizes and instruments may be off by: half-widths of uniform errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Width (m). ISO 37: within 0.05 mm.
    pub width_m: f64,
    /// Thickness, relative. ISO 37: readings within 2 % of their median.
    pub thickness: f64,
    /// First length (m).
    pub gauge_length_m: f64,
    /// Load cell, relative. ISO 7500-1, class 0.5.
    pub load_cell: f64,
    /// Standard deviation of E from specimen to specimen, relative, where only one was pulled: an assumption.
    pub assumed_scatter: f64,
}

impl Default for Tolerances {
    fn default() -> Self {
        Self {
            width_m: 0.05e-3,
            thickness: 0.02,
            gauge_length_m: 0.5e-3,
            load_cell: 0.005,
            assumed_scatter: 0.05,
        }
    }
}

/// Relative standard uncertainties of E.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Width.
    pub width: f64,
    /// Thickness; zero where scatter carries it.
    pub thickness: f64,
    /// First length.
    pub gauge_length: f64,
    /// Load cell.
    pub load_cell: f64,
    /// Whether the start was slack or a tare.
    pub start: f64,
    /// Fit; zero where scatter carries it.
    pub fit: f64,
    /// Specimens, of the median.
    pub scatter: f64,
    /// All of it.
    pub total: f64,
    /// Degrees of freedom of that.
    pub freedom: f64,
}

impl Budget {
    /// `shared`: width, gauge length, load cell, start; `own`: thickness, fit; `scatter`: relative sd of one specimen, and how many.
    pub(super) fn new(shared: [f64; 4], own: [f64; 2], scatter: f64, specimens: usize) -> Self {
        let [width, gauge_length, load_cell, start] = shared;
        let n = specimens.max(1);
        let share = MEDIAN_VARIANCE.get(n - 1).copied().unwrap_or(std::f64::consts::FRAC_PI_2 / n as f64);
        let scatter = share.sqrt() * scatter;
        let [thickness, fit] = if n > 1 { [0.0, 0.0] } else { own };
        let parts = [width, gauge_length, load_cell, start, thickness, fit, scatter];
        let total = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
        let freedom =
            if n > 1 && scatter > 0.0 { (n - 1) as f64 * (total / scatter).powi(4) } else { f64::INFINITY };
        Self { width, thickness, gauge_length, load_cell, start, fit, scatter, total, freedom }
    }

    /// 90 % interval about a value, which is not negative.
    pub(super) fn interval(&self, value: f64) -> [f64; 2] {
        let half = half_90(self.freedom) * self.total * value;
        [(value - half).max(0.0), value + half]
    }
}

//! What one picture consists of, and the truth beside it.

use crate::geometry::Vec3;

/// Eight-bit grey levels, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grey {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Grey levels.
    pub levels: Vec<u8>,
}

/// Distances along the optical axis in counts, row by row; 0 where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Worth of a count (m).
    pub unit_m: f64,
    /// Counts.
    pub counts: Vec<u16>,
}

/// Where a dot is in truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotTruth {
    /// Its number.
    pub number: u32,
    /// Its centre in the phantom frame (m).
    pub position_m: Vec3,
    /// Unit normal of the surface there.
    pub normal: Vec3,
    /// Where the picture shows the centre (px; the first pixel's centre is (0, 0)), also when something hides it; none behind the camera.
    pub pixel: Option<[f64; 2]>,
    /// Share of its area in the picture that is seen: 0 hidden, 1 free.
    pub visible: f64,
    /// When the row of its centre was exposed (s).
    pub time_s: f64,
}

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Its number.
    pub number: u32,
    /// When its first row was exposed (s).
    pub time_s: f64,
    /// When it says that it was taken (s).
    pub reported_s: f64,
    /// Grey levels.
    pub grey: Grey,
    /// Depth, if it is measured.
    pub depth: Option<Depth>,
    /// Truth of every dot.
    pub dots: Vec<DotTruth>,
}

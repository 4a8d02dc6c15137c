//! Which part of a block's surface is meant: `z-,x<60mm` → a side and half-spaces.
//!
//! A region is one side (`x-`, `x+`, `y-`, `y+`, `z-`, `z+`), then, separated by commas, any number of bounds
//! (`x<60mm`, `y>1cm`, `x>0.06m`) that all hold. Blanks do not matter. Lengths carry their unit.

use crate::mesh::{Block, TetMesh};
use std::fmt;
use std::str::FromStr;

/// A side of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    /// 0 for x.
    pub axis: usize,
    /// Whether it is the side of the larger coordinate.
    pub upper: bool,
}

/// A half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// 0 for x.
    pub axis: usize,
    /// Whether the half-space is that of the larger coordinates.
    pub above: bool,
    /// Its limit (m).
    pub limit_m: f64,
}

/// A side, as far as all bounds hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The side.
    pub side: Side,
    /// All of them hold.
    pub bounds: Vec<Bound>,
    text: String,
}

/// Why a text is no region, or a region no part of a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegionError {
    /// The first word is no side.
    #[error("\"{found}\" is no side; expected x-, x+, y-, y+, z- or z+")]
    Side {
        /// The word.
        found: String,
    },
    /// A later word is no bound.
    #[error("\"{found}\" is no bound; expected an axis, < or >, and a length with its unit, such as x<60mm")]
    Bound {
        /// The word.
        found: String,
    },
    /// A length without a known unit, or no number before it.
    #[error("\"{found}\" is no length; expected a number and mm, cm or m, such as 60mm")]
    Length {
        /// The word.
        found: String,
    },
    /// A bound inside a cell.
    #[error(
        "{region}: the limit at {limit_mm} mm cuts through cells, which are {cell_mm} mm long there; expected a multiple of that"
    )]
    CutsCells {
        /// The region.
        region: String,
        /// The limit (mm).
        limit_mm: f64,
        /// Length of a cell (mm).
        cell_mm: f64,
    },
    /// No triangle is inside.
    #[error("{region}: no part of the block")]
    Empty {
        /// The region.
        region: String,
    },
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", AXES[self.axis], if self.upper { "+" } else { "-" })
    }
}

impl FromStr for Side {
    type Err = RegionError;

    fn from_str(text: &str) -> Result<Self, RegionError> {
        let side = AXES.iter().position(|a| text.starts_with(a)).and_then(|axis| match &text[1..] {
            "-" => Some(Self { axis, upper: false }),
            "+" => Some(Self { axis, upper: true }),
            _ => None,
        });
        side.ok_or_else(|| RegionError::Side { found: text.to_owned() })
    }
}

impl FromStr for Bound {
    type Err = RegionError;

    fn from_str(text: &str) -> Result<Self, RegionError> {
        let wrong = || RegionError::Bound { found: text.to_owned() };
        let at = text.find(['<', '>']).ok_or_else(wrong)?;
        let axis = AXES.iter().position(|a| *a == text[..at].trim()).ok_or_else(wrong)?;
        Ok(Self { axis, above: text[at..].starts_with('>'), limit_m: metres(&text[at + 1..])? })
    }
}

/// A length with its unit, in metres.
fn metres(text: &str) -> Result<f64, RegionError> {
    let wrong = || RegionError::Length { found: text.trim().to_owned() };
    // Division by whole numbers gives the number nearest to the decimal; 60 · 1e-3 does not always.
    let (number, per_metre) = [("mm", 1e3), ("cm", 1e2), ("m", 1.0)]
        .into_iter()
        .find_map(|(unit, per)| text.trim().strip_suffix(unit).map(|n| (n.trim(), per)))
        .ok_or_else(wrong)?;
    number.parse::<f64>().ok().filter(|n| n.is_finite()).map(|n| n / per_metre).ok_or_else(wrong)
}

impl FromStr for Region {
    type Err = RegionError;

    fn from_str(text: &str) -> Result<Self, RegionError> {
        let mut words = text.split(',').map(str::trim);
        let side = words.next().unwrap_or_default().parse()?;
        let bounds = words.map(str::parse).collect::<Result<_, _>>()?;
        Ok(Self { side, bounds, text: text.to_owned() })
    }
}

impl Region {
    /// The triangles of the region in a mesh that [`block`](crate::mesh::block) made of `block`.
    ///
    /// # Errors
    /// A bound that cuts through cells, or a region without triangles.
    pub fn select(&self, block: &Block, mesh: &TetMesh) -> Result<Vec<[u32; 3]>, RegionError> {
        for bound in &self.bounds {
            let cell_m = block.size_m[bound.axis] / block.cells[bound.axis] as f64;
            let cells = bound.limit_m / cell_m;
            let inside = bound.limit_m > 0.0 && bound.limit_m < block.size_m[bound.axis];
            if inside && bound.axis != self.side.axis && (cells - cells.round()).abs() > 1e-6 {
                return Err(RegionError::CutsCells {
                    region: self.text.clone(),
                    limit_mm: 1e3 * bound.limit_m,
                    cell_mm: 1e3 * cell_m,
                });
            }
        }
        let holds = |face: &[u32; 3]| {
            let corners = mesh.triangle(*face).0;
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            self.bounds.iter().all(|b| (centre[b.axis] > b.limit_m) == b.above)
        };
        let faces: Vec<[u32; 3]> =
            mesh.surface(&self.side.to_string()).iter().copied().filter(holds).collect();
        if faces.is_empty() { Err(RegionError::Empty { region: self.text.clone() }) } else { Ok(faces) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::block;

    #[test]
    fn lengths_carry_their_unit() {
        for (text, expected) in [("60mm", 0.06), (" 6 cm ", 0.06), ("0.06m", 0.06), ("-1.5e1mm", -0.015)] {
            assert_eq!(metres(text), Ok(expected), "{text}");
        }
        for text in ["60", "mm", "60 inches", "nan mm", "infm", "6,0mm", ""] {
            assert!(matches!(metres(text), Err(RegionError::Length { .. })), "{text}");
        }
    }

    #[test]
    fn a_region_is_a_side_and_bounds() {
        let region: Region = "z-, x<60mm,y > 1cm".parse().expect("a region");
        assert_eq!(region.side, Side { axis: 2, upper: false });
        let expected =
            [Bound { axis: 0, above: false, limit_m: 0.06 }, Bound { axis: 1, above: true, limit_m: 0.01 }];
        assert_eq!(region.bounds, expected);
        assert!(matches!("w+".parse::<Region>(), Err(RegionError::Side { .. })));
        assert!(matches!("z".parse::<Region>(), Err(RegionError::Side { .. })));
        assert!(matches!("é-".parse::<Region>(), Err(RegionError::Side { .. })));
        assert!(matches!("".parse::<Region>(), Err(RegionError::Side { .. })));
        assert!(matches!("z-,x=3mm".parse::<Region>(), Err(RegionError::Bound { .. })));
        assert!(matches!("z-,q<3mm".parse::<Region>(), Err(RegionError::Bound { .. })));
        assert!(matches!("z-,".parse::<Region>(), Err(RegionError::Bound { .. })));
    }

    #[test]
    fn a_selected_region_has_its_area() {
        let slab = Block { size_m: [0.15, 0.1, 0.025], cells: [15, 10, 3] };
        let mesh = block(&slab).expect("a block");
        let area = |text: &str| -> Result<f64, RegionError> {
            let faces = text.parse::<Region>()?.select(&slab, &mesh)?;
            Ok(faces.into_iter().map(|f| mesh.triangle(f).area()).sum())
        };
        for (text, expected) in [
            ("z-", 0.015),
            ("z-,x<60mm", 0.006),
            ("z-,x>60mm", 0.009),
            ("z+,x>6cm,x<0.07m,y<10mm", 1e-4),
            ("x+,y>90mm", 0.00025),
            ("y+,x<1m", 0.00375),
        ] {
            let found = area(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!((found / expected - 1.0).abs() < 1e-12, "{text}: {found}");
        }
        assert!(matches!(area("z-,x<64mm"), Err(RegionError::CutsCells { .. })));
        assert!(matches!(area("z-,x<0mm"), Err(RegionError::Empty { .. })));
    }
}

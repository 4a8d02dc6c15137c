//! Which material fills which cell.

use super::FiniteError;
use crate::fem::material::Material;

/// One material, in every cell with its own multiple of Young's modulus (an inclusion, say; ν stays).
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    material: Material,
    /// Multiple of the modulus by cell (–); empty: 1 everywhere.
    relative_modulus: Vec<f64>,
}

impl Solid {
    /// The same material everywhere.
    pub fn homogeneous(material: Material) -> Self {
        Self { material, relative_modulus: Vec::new() }
    }

    /// A material whose modulus is multiplied cell by cell (–, more than 0).
    pub fn graded(material: Material, relative_modulus: Vec<f64>) -> Result<Self, FiniteError> {
        if let Some((index, &value)) =
            relative_modulus.iter().enumerate().find(|&(_, &r)| !(r > 0.0 && r.is_finite()))
        {
            let expected = "a finite number above 0";
            return Err(FiniteError::Value { what: "relative modulus", index, value, expected });
        }
        Ok(Self { material, relative_modulus })
    }

    /// The material at a relative modulus of 1.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Multiple of the modulus in a cell (–).
    pub fn relative_modulus(&self, cell: usize) -> f64 {
        self.relative_modulus.get(cell).copied().unwrap_or(1.0)
    }

    pub(super) fn check(&self, cells: usize) -> Result<(), FiniteError> {
        let found = self.relative_modulus.len();
        if found != 0 && found != cells {
            return Err(FiniteError::Length { what: "relative moduli", expected: cells, found });
        }
        Ok(())
    }
}

//! Numbers of VTK's scalar types, from words or from bytes.

use super::MeshFileError;

/// A scalar type of VTK.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// The values of an array.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Values {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

impl Scalar {
    /// A type by its name in VTU files.
    pub(super) fn of_vtu(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// A type by its name in legacy files. `vtkIdType` is written there as a 32-bit number.
    pub(super) fn of_legacy(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "char" | "signed_char" | "vtktypeint8" => Self::I8,
            "unsigned_char" | "vtktypeuint8" => Self::U8,
            "short" | "vtktypeint16" => Self::I16,
            "unsigned_short" | "vtktypeuint16" => Self::U16,
            "int" | "vtkidtype" | "vtktypeint32" => Self::I32,
            "unsigned_int" | "vtktypeuint32" => Self::U32,
            "long" | "vtktypeint64" => Self::I64,
            "unsigned_long" | "vtktypeuint64" => Self::U64,
            "float" => Self::F32,
            "double" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Whether its numbers are whole.
    pub(super) fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The numbers in `bytes`; an incomplete one at the end is left out.
    pub(super) fn decode(self, bytes: &[u8], big_endian: bool) -> Values {
        // The number's bytes as the low end of a 64-bit word.
        let words = bytes.chunks_exact(self.size()).map(|chunk| {
            let step = |word: u64, &byte: &u8| word << 8 | u64::from(byte);
            if big_endian { chunk.iter().fold(0, step) } else { chunk.iter().rev().fold(0, step) }
        });
        match self {
            Self::F32 => Values::Real(words.map(|w| f32::from_bits(w as u32).into()).collect()),
            Self::F64 => Values::Real(words.map(f64::from_bits).collect()),
            Self::I8 => Values::Whole(words.map(|w| (w as i8).into()).collect()),
            Self::I16 => Values::Whole(words.map(|w| (w as i16).into()).collect()),
            Self::I32 => Values::Whole(words.map(|w| (w as i32).into()).collect()),
            // Node and group numbers above 2⁶³ do not exist; what wraps is refused as negative later.
            _ => Values::Whole(words.map(|w| w as i64).collect()),
        }
    }
}

impl Values {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Whole(v) => v.len(),
            Self::Real(v) => v.len(),
        }
    }

    /// The values as reals.
    pub(super) fn reals(self) -> Vec<f64> {
        match self {
            Self::Whole(v) => v.into_iter().map(|x| x as f64).collect(),
            Self::Real(v) => v,
        }
    }

    /// The values as whole numbers; reals are refused by the array's name unless they are whole.
    pub(super) fn whole(self, array: &str) -> Result<Vec<i64>, MeshFileError> {
        match self {
            Self::Whole(v) => Ok(v),
            Self::Real(v) => v
                .into_iter()
                .map(|x| {
                    if x.fract() == 0.0 && x.abs() < 2_f64.powi(53) {
                        Ok(x as i64)
                    } else {
                        Err(MeshFileError::NotWhole { array: array.to_owned(), value: x })
                    }
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_reads_in_both_byte_orders() {
        let little: [(Scalar, &[u8], Values); 10] = [
            (Scalar::I8, &(-3_i8).to_le_bytes(), Values::Whole(vec![-3])),
            (Scalar::U8, &200_u8.to_le_bytes(), Values::Whole(vec![200])),
            (Scalar::I16, &(-300_i16).to_le_bytes(), Values::Whole(vec![-300])),
            (Scalar::U16, &60_000_u16.to_le_bytes(), Values::Whole(vec![60_000])),
            (Scalar::I32, &(-70_000_i32).to_le_bytes(), Values::Whole(vec![-70_000])),
            (Scalar::U32, &4_000_000_000_u32.to_le_bytes(), Values::Whole(vec![4_000_000_000])),
            (Scalar::I64, &(-5_i64).to_le_bytes(), Values::Whole(vec![-5])),
            (Scalar::U64, &5_u64.to_le_bytes(), Values::Whole(vec![5])),
            (Scalar::F32, &0.5_f32.to_le_bytes(), Values::Real(vec![0.5])),
            (Scalar::F64, &(-0.1_f64).to_le_bytes(), Values::Real(vec![-0.1])),
        ];
        for (scalar, bytes, expected) in little {
            assert_eq!(scalar.decode(bytes, false), expected, "{scalar:?}");
            let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!(scalar.decode(&reversed, true), expected, "{scalar:?}, big endian");
        }
    }

    #[test]
    fn only_whole_reals_are_whole_numbers() {
        assert!(matches!(Values::Real(vec![1.0, 12.0]).whole("group"), Ok(v) if v == [1, 12]));
        for odd in [0.5, f64::NAN, f64::INFINITY, 1e300] {
            assert!(matches!(Values::Real(vec![odd]).whole("group"), Err(MeshFileError::NotWhole { .. })));
        }
    }
}

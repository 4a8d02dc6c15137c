//! How is a sum kept to twice the digits of a double? As an unevaluated pair: value = high + low, |low| ≤ ulp(high)/2.
//!
//! Error-free transformations: sum s + e = a + b by Knuth (1969, The Art of Computer Programming 2, 4.2.2), product p + e = a·b by one fused
//! multiply-add. Pairs are combined as by Dekker (1971, Numerische Mathematik 18, 224–242): about 31 digits. Why: the design of a
//! polynomial of degree ten in its plain powers (NIST, Filip) has a condition of 1e15, which leaves a double nothing.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of about 31 digits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Twofold {
    high: f64,
    low: f64,
}

/// a + b exactly, |a| ≥ |b|.
fn quick(a: f64, b: f64) -> Twofold {
    let high = a + b;
    Twofold { high, low: b - (high - a) }
}

/// a + b exactly.
fn sum(a: f64, b: f64) -> Twofold {
    let high = a + b;
    let part = high - a;
    Twofold { high, low: (a - (high - part)) + (b - part) }
}

impl Twofold {
    pub(super) const ZERO: Self = Self { high: 0.0, low: 0.0 };
    pub(super) const ONE: Self = Self { high: 1.0, low: 0.0 };

    pub(super) fn rounded(self) -> f64 {
        self.high + self.low
    }

    pub(super) fn square_root(self) -> Self {
        if self.high <= 0.0 {
            return Self::ZERO;
        }
        // One step of Newton on the rounded root doubles its digits.
        let root = Self::from(self.high.sqrt());
        root + (self - root * root) / (root + root)
    }
}

impl From<f64> for Twofold {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Twofold {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (h, l) = (sum(self.high, other.high), sum(self.low, other.low));
        let first = quick(h.high, h.low + l.high);
        quick(first.high, first.low + l.low)
    }
}

impl Neg for Twofold {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Twofold {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Twofold {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let low = self.high.mul_add(other.high, -high);
        quick(high, low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Twofold {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        quick(first, second) + Self::from(rest.high / other.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 + 2⁻⁸⁰) − 1 is lost in a double. √2 to 32 digits: 1.4142135623730950 4880168872420970.
    #[test]
    fn twice_the_digits() {
        let tiny = 2_f64.powi(-80);
        let one = Twofold::ONE + Twofold::from(tiny);
        assert_eq!((one - Twofold::ONE).rounded(), tiny);
        let root = Twofold::from(2.0).square_root();
        assert!((root * root - Twofold::from(2.0)).rounded().abs() < 1e-31);
        let third = Twofold::ONE / Twofold::from(3.0);
        assert!((third * Twofold::from(3.0) - Twofold::ONE).rounded().abs() < 1e-31);
    }
}

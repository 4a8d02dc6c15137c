//! What a picture is: rows of 8-bit grey levels, or of 16-bit depths, in memory that belongs to somebody else.
//!
//! Pixel (0, 0) is the upper left one and its centre has the coordinates (0, 0); x goes right, y goes down.

use super::TrackError;

/// A grey picture: 0 is black.
#[derive(Debug, Clone, Copy)]
pub struct GreyView<'a> {
    width: usize,
    height: usize,
    stride: usize,
    pixels: &'a [u8],
}

/// A depth picture: distance along the optical axis, 0 where there is none.
#[derive(Debug, Clone, Copy)]
pub struct DepthView<'a> {
    width: usize,
    height: usize,
    stride: usize,
    values: &'a [u16],
    metres_per_unit: f64,
}

/// How the channels of a colour picture follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Red, green, blue.
    Rgb,
    /// Blue, green, red.
    Bgr,
}

/// An unreadable picture is refused before anybody indexes into it.
fn check(
    picture: &'static str,
    [width, height]: [usize; 2],
    row: usize,
    stride: usize,
    values: usize,
) -> Result<(), TrackError> {
    if width == 0 || height == 0 {
        return Err(TrackError::Empty { picture, width, height });
    }
    let needed = stride.saturating_mul(height - 1).saturating_add(row);
    if stride < row || values < needed {
        return Err(TrackError::Buffer { picture, width, height, stride, values, needed });
    }
    Ok(())
}

impl<'a> GreyView<'a> {
    /// `stride`: pixels from the start of a row to the start of the next.
    ///
    /// # Errors
    /// [`TrackError`]: no pixels, or fewer than the size needs.
    pub fn new(width: usize, height: usize, stride: usize, pixels: &'a [u8]) -> Result<Self, TrackError> {
        check("grey", [width, height], width, stride, pixels.len())?;
        Ok(Self { width, height, stride, pixels })
    }

    /// Width and height (px).
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The pixels of a row.
    pub fn row(&self, y: usize) -> &'a [u8] {
        &self.pixels[y * self.stride..y * self.stride + self.width]
    }
}

impl<'a> DepthView<'a> {
    /// `stride`: values from the start of a row to the start of the next.
    ///
    /// # Errors
    /// [`TrackError`]: no values, fewer than the size needs, or a unit that is not positive.
    pub fn new(
        width: usize,
        height: usize,
        stride: usize,
        values: &'a [u16],
        metres_per_unit: f64,
    ) -> Result<Self, TrackError> {
        check("depth", [width, height], width, stride, values.len())?;
        if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
            return Err(TrackError::Setting {
                name: "metres_per_unit",
                value: metres_per_unit,
                expected: "a positive number",
            });
        }
        Ok(Self { width, height, stride, values, metres_per_unit })
    }

    /// Width and height (px).
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The values of a row, in units.
    pub fn row(&self, y: usize) -> &'a [u16] {
        &self.values[y * self.stride..y * self.stride + self.width]
    }

    /// One unit (m).
    pub fn metres_per_unit(&self) -> f64 {
        self.metres_per_unit
    }

    /// The largest value, in units, of every fourth row.
    pub(super) fn largest(&self) -> u16 {
        (0..self.height)
            .step_by(4)
            .map(|y| self.row(y).iter().fold(0, |most, &v| most.max(v)))
            .max()
            .unwrap_or(0)
    }
}

/// Grey levels of a colour picture: the luma of ITU-R BT.601 (0.299 R + 0.587 G + 0.114 B), rounded.
///
/// `stride`: bytes from the start of a row to the start of the next. The result has `width` pixels a row.
///
/// # Errors
/// [`TrackError`]: no pixels, or fewer than the size needs.
pub fn grey_from_colour(
    width: usize,
    height: usize,
    stride: usize,
    bytes: &[u8],
    channels: Channels,
) -> Result<Vec<u8>, TrackError> {
    check("colour", [width, height], 3 * width, stride, bytes.len())?;
    let weights: [u32; 3] = match channels {
        Channels::Rgb => [19_595, 38_470, 7_471],
        Channels::Bgr => [7_471, 38_470, 19_595],
    };
    let mut grey = Vec::with_capacity(width * height);
    for y in 0..height {
        let (pixels, _) = bytes[y * stride..y * stride + 3 * width].as_chunks::<3>();
        grey.extend(pixels.iter().map(|pixel| {
            let sum: u32 = pixel.iter().zip(weights).map(|(&p, w)| u32::from(p) * w).sum();
            // The weights add up to 2¹⁶, so that this fits into eight bits.
            ((sum + 0x7fff) >> 16) as u8
        }));
    }
    Ok(grey)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_the_stride() {
        let pixels: Vec<u8> = (0..23).collect();
        let view = GreyView::new(3, 4, 6, &pixels).expect("21 pixels are enough");
        assert_eq!(view.row(3), [18, 19, 20]);
        assert_eq!(view.size(), [3, 4]);
    }

    #[test]
    fn a_buffer_too_short_is_refused_with_its_numbers() {
        let error = GreyView::new(640, 480, 640, &[0; 100]).expect_err("too short");
        assert!(error.to_string().contains("needs 307200 values, but has 100"), "{error}");
        assert!(GreyView::new(4, 2, 3, &[0; 100]).is_err());
        assert!(GreyView::new(usize::MAX, usize::MAX, usize::MAX, &[0; 100]).is_err());
        assert_eq!(
            GreyView::new(0, 480, 0, &[]).err(),
            Some(TrackError::Empty { picture: "grey", width: 0, height: 480 })
        );
        assert!(DepthView::new(1, 1, 1, &[0], 0.0).is_err());
        assert!(DepthView::new(1, 1, 1, &[0], f64::NAN).is_err());
    }

    /// The weights of ITU-R BT.601, section 2.5.1.
    #[test]
    fn colours_have_the_published_luma() {
        let bytes = [255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
        assert_eq!(grey_from_colour(4, 1, 12, &bytes, Channels::Rgb).expect("grey"), [76, 150, 29, 255]);
        assert_eq!(grey_from_colour(4, 1, 12, &bytes, Channels::Bgr).expect("grey"), [29, 150, 76, 255]);
        assert!(grey_from_colour(4, 2, 12, &bytes, Channels::Rgb).is_err());
    }
}

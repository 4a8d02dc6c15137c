//! What a picture from OpenCV is, checked, and its values taken out of it.

use crate::device::{DepthPicture, GreyPicture};
use opencv::core::{CV_8UC1, CV_8UC3, CV_16UC1, Mat};
use opencv::prelude::*;

/// What a stream's pictures have to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// 8 bits in one channel, or blue, green and red.
    Grey,
    /// 16 bits in one channel.
    Depth,
    /// So, or the same as bytes in one row: how OpenCV passes on a format of Video4Linux that it does not know.
    DepthOrBytes,
    /// Grey levels above the bytes of distances.
    Stacked,
    /// Both, retrieved separately, from these channels of the capture.
    Both { grey: i32, depth: i32 },
}

/// What was taken out of what was grabbed at one time.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    pub(super) grey: Option<GreyPicture>,
    pub(super) depth: Option<DepthPicture>,
}

/// A picture that is none, or another one than expected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Malformed {
    pub(super) found: String,
    pub(super) expected: String,
}

/// The levels of a grey picture, or the luma of a colour one, into memory that may have been used before.
pub(super) fn grey(
    mat: &Mat,
    [width, height]: [usize; 2],
    mut pixels: Vec<u8>,
) -> Result<GreyPicture, Malformed> {
    let refused =
        || malformed(mat, format!("8 bits in 1 channel, or in 3 of a colour picture, {width} × {height}"));
    if extent(mat) != [width, height] || ![CV_8UC1, CV_8UC3].contains(&mat.typ()) {
        return Err(refused());
    }
    let bytes = mat.data_bytes().map_err(|_| refused())?;
    pixels.clear();
    if mat.typ() == CV_8UC1 {
        pixels.extend_from_slice(bytes);
    } else {
        pixels.extend(bytes.as_chunks::<3>().0.iter().map(luma));
    }
    Ok(GreyPicture { width, height, pixels })
}

/// 0.299 R + 0.587 G + 0.114 B, rounded (ITU-R BT.601, section 2.5.1).
fn luma(&[blue, green, red]: &[u8; 3]) -> u8 {
    let sum = 19_595 * u32::from(red) + 38_470 * u32::from(green) + 7_471 * u32::from(blue);
    // The weights add up to 2¹⁶, so that this fits into eight bits.
    ((sum + 0x7fff) >> 16) as u8
}

/// The distances of a depth picture.
pub(super) fn depth(
    mat: &Mat,
    [width, height]: [usize; 2],
    or_bytes: bool,
    mut values: Vec<u16>,
) -> Result<DepthPicture, Malformed> {
    let refused = || malformed(mat, format!("16 bits in 1 channel, {width} × {height}"));
    values.clear();
    if mat.typ() == CV_16UC1 && extent(mat) == [width, height] {
        values.extend_from_slice(mat.data_typed::<u16>().map_err(|_| refused())?);
    } else if or_bytes && mat.typ() == CV_8UC1 && extent(mat) == [2 * width * height, 1] {
        extend_by_bytes(&mut values, mat.data_bytes().map_err(|_| refused())?);
    } else {
        return Err(refused());
    }
    Ok(DepthPicture { width, height, values })
}

/// Both pictures of one that holds the grey levels above the bytes of the distances.
pub(super) fn stacked(
    mat: &Mat,
    [width, height]: [usize; 2],
    mut pixels: Vec<u8>,
    mut values: Vec<u16>,
) -> Result<Pictures, Malformed> {
    let refused = || {
        malformed(
            mat,
            format!("8 bits in 1 channel, {width} × {} (grey above two bytes a distance)", 3 * height),
        )
    };
    if mat.typ() != CV_8UC1 || extent(mat) != [width, 3 * height] {
        return Err(refused());
    }
    let (levels, bytes) = mat.data_bytes().map_err(|_| refused())?.split_at(width * height);
    pixels.clear();
    pixels.extend_from_slice(levels);
    values.clear();
    extend_by_bytes(&mut values, bytes);
    let grey = Some(GreyPicture { width, height, pixels });
    Ok(Pictures { grey, depth: Some(DepthPicture { width, height, values }) })
}

fn extend_by_bytes(values: &mut Vec<u16>, bytes: &[u8]) {
    values.extend(bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair)));
}

/// Width and height.
fn extent(mat: &Mat) -> [usize; 2] {
    [mat.cols(), mat.rows()].map(|n| usize::try_from(n).unwrap_or(0))
}

fn malformed(mat: &Mat, expected: String) -> Malformed {
    let [width, height] = extent(mat);
    let found = if mat.empty() {
        "an empty picture".to_owned()
    } else {
        let (bits, channels) = (8 * mat.elem_size1(), mat.channels());
        format!(
            "{bits} bits in {channels} channel{}, {width} × {height}",
            if channels == 1 { "" } else { "s" }
        )
    };
    Malformed { found, expected }
}

#[cfg(test)]
mod tests {
    use super::*;
    use opencv::core::{CV_8UC2, CV_32FC1, Scalar};

    fn mat(rows: i32, columns: i32, kind: i32) -> Mat {
        Mat::new_rows_cols_with_default(rows, columns, kind, Scalar::all(7.0)).expect("a picture")
    }

    #[test]
    fn other_kinds_of_pictures_are_refused_with_what_they_are() {
        let said = |refusal: Result<DepthPicture, Malformed>| refusal.expect_err("refused").found;
        assert_eq!(said(depth(&mat(4, 6, CV_8UC1), [6, 4], true, vec![])), "8 bits in 1 channel, 6 × 4");
        assert_eq!(said(depth(&mat(4, 6, CV_8UC3), [6, 4], true, vec![])), "8 bits in 3 channels, 6 × 4");
        assert_eq!(said(depth(&mat(4, 6, CV_32FC1), [6, 4], false, vec![])), "32 bits in 1 channel, 6 × 4");
        assert_eq!(said(depth(&mat(4, 6, CV_16UC1), [4, 6], false, vec![])), "16 bits in 1 channel, 6 × 4");
        assert_eq!(said(depth(&Mat::default(), [4, 6], false, vec![])), "an empty picture");
        assert_eq!(said(depth(&mat(1, 48, CV_8UC1), [6, 4], false, vec![])), "8 bits in 1 channel, 48 × 1");
        for kind in [CV_8UC2, CV_16UC1] {
            let refusal = grey(&mat(4, 6, kind), [6, 4], vec![]).expect_err("refused");
            assert!(refusal.expected.ends_with("6 × 4"), "{refusal:?}");
        }
        assert!(stacked(&mat(4, 6, CV_8UC1), [6, 4], vec![], vec![]).is_err());
    }

    #[test]
    fn bytes_become_distances() {
        let row = Mat::from_slice(&[0x34_u8, 0x12, 0xff, 0x00]).expect("a row").try_clone().expect("memory");
        let picture = depth(&row, [2, 1], true, vec![9]).expect("a depth picture");
        assert_eq!(picture.values, [0x1234, 0x00ff]);

        let column = Mat::from_slice_2d(&[[1_u8, 2], [0x34, 0x12], [0xff, 0x00]]).expect("three rows");
        let both = stacked(&column, [2, 1], vec![9], vec![9]).expect("both pictures");
        assert_eq!(both.grey.expect("grey").pixels, [1, 2]);
        assert_eq!(both.depth.expect("depth").values, [0x1234, 0x00ff]);
    }

    /// The weights of ITU-R BT.601, section 2.5.1.
    #[test]
    fn colours_have_the_published_luma() {
        let levels = [[0, 0, 255], [0, 255, 0], [255, 0, 0], [255, 255, 255]].map(|bgr| luma(&bgr));
        assert_eq!(levels, [76, 150, 29, 255]);
    }
}

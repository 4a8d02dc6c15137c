//! What a letter looks like in pixels, for pictures that are PNG files: five columns and eight rows, the last for what hangs below the line.
//!
//! Why: a picture that says its times and numbers must not need a font of the machine that makes it.

use image::{Rgb, RgbImage};

/// Rows of a letter.
const ROWS: u32 = 8;
/// Columns from the beginning of a letter to that of the next.
const ADVANCE: u32 = 6;
/// What lies around letters that are written upon a picture.
const HALO: Rgb<u8> = Rgb([0; 3]);

/// Letters that stand side by side, and their rows.
const SHAPES: [(&str, [&str; ROWS as usize]); 6] = [
    (
        "0123456789+-.,:;",
        [
            ".###. ..#.. .###. ##### ...#. ##### ..##. ##### .###. .###. ..... ..... ..... ..... ..... .....",
            "#...# .##.. #...# ...#. ..##. #.... .#... ....# #...# #...# ..#.. ..... ..... ..... .##.. ..##.",
            "#...# ..#.. ....# ..#.. .#.#. ####. #.... ...#. #...# #...# ..#.. ..... ..... ..... .##.. ..##.",
            "#...# ..#.. ...#. ...#. #..#. ....# ####. ..#.. .###. .#### ##### ##### ..... ..... ..... .....",
            "#...# ..#.. ..#.. ....# ##### ....# #...# .#... #...# ....# ..#.. ..... ..... ..... .##.. ..#..",
            "#...# ..#.. .#... #...# ...#. #...# #...# .#... #...# ...#. ..#.. ..... .##.. ..#.. .##.. ..#..",
            ".###. .###. ##### .###. ...#. .###. .###. .#... .###. .##.. ..... ..... .##.. ..#.. ..... ..#..",
            "..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .#... ..... .#...",
        ],
    ),
    (
        "ABCDEFGHIJKLMNOP",
        [
            ".###. ####. .###. ###.. ##### ##### .###. #...# .###. ..### #...# #.... #...# #...# .###. ####.",
            "#...# #...# #...# #..#. #.... #.... #...# #...# ..#.. ...#. #..#. #.... ##.## #...# #...# #...#",
            "#...# #...# #.... #...# #.... #.... #.... #...# ..#.. ...#. #.#.. #.... #.#.# ##..# #...# #...#",
            "#...# ####. #.... #...# ####. ####. #.### ##### ..#.. ...#. ##... #.... #.#.# #.#.# #...# ####.",
            "##### #...# #.... #...# #.... #.... #...# #...# ..#.. ...#. #.#.. #.... #...# #..## #...# #....",
            "#...# #...# #...# #..#. #.... #.... #...# #...# ..#.. #..#. #..#. #.... #...# #...# #...# #....",
            "#...# ####. .###. ###.. ##### #.... .#### #...# .###. .##.. #...# ##### #...# #...# .###. #....",
            "..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .....",
        ],
    ),
    (
        "QRSTUVWXYZ()[]/%",
        [
            ".###. ####. .#### ##### #...# #...# #...# #...# #...# ##### ...#. .#... .###. .###. ..... ##...",
            "#...# #...# #.... ..#.. #...# #...# #...# #...# #...# ....# ..#.. ..#.. .#... ...#. ....# ##..#",
            "#...# #...# #.... ..#.. #...# #...# #...# .#.#. #...# ...#. .#... ...#. .#... ...#. ...#. ...#.",
            "#...# ####. .###. ..#.. #...# #...# #.#.# ..#.. .#.#. ..#.. .#... ...#. .#... ...#. ..#.. ..#..",
            "#.#.# #.#.. ....# ..#.. #...# #...# #.#.# .#.#. ..#.. .#... .#... ...#. .#... ...#. .#... .#...",
            "#..#. #..#. ....# ..#.. #...# .#.#. #.#.# #...# ..#.. #.... ..#.. ..#.. .#... ...#. #.... #..##",
            ".##.# #...# ####. ..#.. .###. ..#.. .#.#. #...# ..#.. ##### ...#. .#... .###. .###. ..... ...##",
            "..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... ..... .....",
        ],
    ),
    (
        "abcdefghijklmnop",
        [
            "..... #.... ..... ....# ..... ..##. ..... #.... ..#.. ...#. #.... .##.. ..... ..... ..... .....",
            "..... #.... ..... ....# ..... .#..# ..... #.... ..... ..... #.... ..#.. ..... ..... ..... .....",
            ".###. #.##. .###. .##.# .###. .#... .#### #.##. .##.. ..##. #..#. ..#.. ##.#. #.##. .###. ####.",
            "....# ##..# #.... #..## #...# ###.. #...# ##..# ..#.. ...#. #.#.. ..#.. #.#.# ##..# #...# #...#",
            ".#### #...# #.... #...# ##### .#... #...# #...# ..#.. ...#. ##... ..#.. #.#.# #...# #...# #...#",
            "#...# #...# #...# #...# #.... .#... .#### #...# ..#.. ...#. #.#.. ..#.. #...# #...# #...# ####.",
            ".#### ####. .###. .#### .###. .#... ....# #...# .###. #..#. #..#. .###. #...# #...# .###. #....",
            "..... ..... ..... ..... ..... ..... .###. ..... ..... .##.. ..... ..... ..... ..... ..... #....",
        ],
    ),
    (
        "qrstuvwxyz=<>'\"!",
        [
            "..... ..... ..... .#... ..... ..... ..... ..... ..... ..... ..... ...#. .#... ..#.. .#.#. ..#..",
            "..... ..... ..... .#... ..... ..... ..... ..... ..... ..... ..... ..#.. ..#.. ..#.. .#.#. ..#..",
            ".#### #.##. .###. ###.. #...# #...# #...# #...# #...# ##### ##### .#... ...#. ..#.. .#.#. ..#..",
            "#...# ##..# #.... .#... #...# #...# #...# .#.#. #...# ...#. ..... #.... ....# ..... ..... ..#..",
            "#...# #.... .###. .#... #...# #...# #.#.# ..#.. #...# ..#.. ##### .#... ...#. ..... ..... ..#..",
            ".#### #.... ....# .#..# #..## .#.#. #.#.# .#.#. .#### .#... ..... ..#.. ..#.. ..... ..... .....",
            "....# #.... ####. ..##. .##.# ..#.. .#.#. #...# ....# ##### ..... ...#. .#... ..... ..... ..#..",
            "....# ..... ..... ..... ..... ..... ..... ..... .###. ..... ..... ..... ..... ..... ..... .....",
        ],
    ),
    (
        "#&*?@_|\\",
        [
            ".#.#. .#... ..... .###. .###. ..... ..#.. .....",
            ".#.#. #.#.. ..#.. #...# #...# ..... ..#.. #....",
            "##### #.#.. #.#.# ....# #.### ..... ..#.. .#...",
            ".#.#. .#... .###. ...#. #.#.# ..... ..#.. ..#..",
            "##### #.#.# #.#.# ..#.. #.### ..... ..#.. ...#.",
            ".#.#. #..#. ..#.. ..... #.... ..... ..#.. ....#",
            ".#.#. .##.# ..... ..#.. .###. ##### ..#.. .....",
            "..... ..... ..... ..... ..... ..... ..... .....",
        ],
    ),
];

/// Size of a text (px) when each of its pixels is `size` px wide: without the gap behind its last letter.
pub(super) fn extent(text: &str, size: u32) -> [u32; 2] {
    let letters = text.chars().count() as u32;
    [(letters * ADVANCE).saturating_sub(1) * size, ROWS * size]
}

/// Writes a text with its upper left corner at `corner`, each of its pixels `size` px wide. What lies outside the picture is cut off.
pub(super) fn write(picture: &mut RgbImage, corner: [i64; 2], size: u32, text: &str, ink: Rgb<u8>) {
    for (number, letter) in (0..).zip(text.chars()) {
        each_pixel(letter, |column, row| {
            let at = [
                corner[0] + i64::from((number * ADVANCE + column) * size),
                corner[1] + i64::from(row * size),
            ];
            fill(picture, at, [i64::from(size); 2], ink);
        });
    }
}

/// The same with a dark rim, to be read upon anything.
pub(super) fn write_with_halo(picture: &mut RgbImage, corner: [i64; 2], size: u32, text: &str, ink: Rgb<u8>) {
    let rim = i64::from(size.div_ceil(2));
    for shift in [[-rim, 0], [rim, 0], [0, -rim], [0, rim]] {
        write(picture, [corner[0] + shift[0], corner[1] + shift[1]], size, text, HALO);
    }
    write(picture, corner, size, text, ink);
}

/// Fills a rectangle, as far as it lies in the picture.
fn fill(picture: &mut RgbImage, corner: [i64; 2], size: [i64; 2], colour: Rgb<u8>) {
    let within = |from: i64, length: i64, end: u32| from.max(0)..(from + length).min(i64::from(end));
    for y in within(corner[1], size[1], picture.height()) {
        for x in within(corner[0], size[0], picture.width()) {
            picture.put_pixel(x as u32, y as u32, colour);
        }
    }
}

/// Calls for column and row of each pixel of a letter. One that there is no shape of is a question mark.
fn each_pixel(letter: char, mut call: impl FnMut(u32, u32)) {
    if letter == ' ' {
        return;
    }
    let of = |letter: char| {
        SHAPES.iter().find_map(|(letters, rows)| letters.find(letter).map(|place| (place, rows)))
    };
    let Some((place, rows)) = of(letter).or_else(|| of('?')) else { return };
    for (row, line) in (0..).zip(rows) {
        let pixels = line.bytes().skip(place * ADVANCE as usize).take(ADVANCE as usize - 1);
        (0..).zip(pixels).filter(|(_, pixel)| *pixel == b'#').for_each(|(column, _)| call(column, row));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn shape(letter: char) -> Vec<(u32, u32)> {
        let mut pixels = Vec::new();
        each_pixel(letter, |column, row| pixels.push((column, row)));
        pixels
    }

    #[test]
    fn every_letter_has_a_shape_of_its_own_but_zero_and_o() {
        let letters: String = SHAPES.iter().map(|(letters, _)| *letters).collect();
        for needed in ('0'..='9').chain('a'..='z').chain('A'..='Z').chain(".,:;+-%()/=".chars()) {
            assert!(letters.contains(needed), "{needed}");
        }
        for (letters, rows) in SHAPES {
            let columns = letters.len() * ADVANCE as usize - 1;
            assert!(rows.iter().all(|row| row.len() == columns), "{letters}");
        }
        let shapes: BTreeSet<_> = letters.chars().map(shape).collect();
        assert_eq!((shape('0'), shapes.len()), (shape('O'), letters.len() - 1));
        assert_eq!((shape('µ'), shape(' ')), (shape('?'), vec![]));
    }

    #[test]
    fn a_text_is_as_large_as_is_said_and_is_cut_at_the_border() {
        let ink = Rgb([255, 0, 0]);
        let mut picture = RgbImage::new(60, 40);
        write(&mut picture, [10, 5], 2, "1j", ink);
        let inked = |picture: &RgbImage, of: fn(u32, u32) -> u32| {
            let places = picture.enumerate_pixels().filter(|(.., p)| **p == ink).map(|(x, y, _)| of(x, y));
            let places: BTreeSet<u32> = places.collect();
            (places.first().copied(), places.last().copied())
        };
        // "1" begins in its second column, "j" ends in its fourth and hangs down to the last row.
        assert_eq!(extent("1j", 2), [22, 16]);
        assert_eq!(inked(&picture, |x, _| x), (Some(12), Some(10 + 22 - 2 - 1)));
        assert_eq!(inked(&picture, |_, y| y), (Some(5), Some(5 + 16 - 1)));
        let mut cut = RgbImage::new(60, 40);
        write_with_halo(&mut cut, [-9, -9], 3, "88", ink);
        write_with_halo(&mut cut, [55, 35], 3, "88", ink);
        assert!(cut.pixels().any(|p| *p == ink));
    }
}

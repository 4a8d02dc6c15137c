//! Which entries of a symmetric matrix may be non-zero.

/// Lower triangle, diagonal included, of a symmetric matrix in compressed-column form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Where each column starts in `rows`; `n + 1` entries.
    column_starts: Vec<u32>,
    /// Row indices, ascending in each column; the first one is the diagonal.
    rows: Vec<u32>,
}

impl Pattern {
    /// The pattern of `n` unknowns where every element couples all unknowns in its list with each other.
    /// Always contains the diagonal.
    ///
    /// # Panics
    /// When an element lists an unknown that is not below `n`, or the pattern has 2³² entries or more.
    pub fn from_elements<'a>(n: usize, elements: impl Iterator<Item = &'a [u32]> + Clone) -> Self {
        let (starts, owners) = elements_of_unknowns(n, elements.clone());
        let lists: Vec<&[u32]> = elements.collect();
        let of = |unknown: usize| &owners[starts[unknown]..starts[unknown + 1]];

        let mut column_starts = Vec::with_capacity(n + 1);
        column_starts.push(0);
        let mut rows = Vec::new();
        // Unknowns of one node have the same elements and so the same neighbours: they are gathered once.
        let mut neighbours: Vec<u32> = Vec::new();
        let mut seen_for = vec![u32::MAX; n];
        for column in 0..n {
            if column == 0 || of(column) != of(column - 1) || of(column).is_empty() {
                neighbours.clear();
                neighbours.push(column as u32);
                seen_for[column] = column as u32;
                for &element in of(column) {
                    for &unknown in lists[element as usize] {
                        if seen_for[unknown as usize] != column as u32 {
                            seen_for[unknown as usize] = column as u32;
                            neighbours.push(unknown);
                        }
                    }
                }
                neighbours.sort_unstable();
            }
            let lower = neighbours.partition_point(|&row| (row as usize) < column);
            rows.extend_from_slice(&neighbours[lower..]);
            column_starts.push(u32::try_from(rows.len()).expect("fewer than 2³² entries"));
        }
        Self { column_starts, rows }
    }

    /// Number of unknowns.
    pub fn dimension(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// Number of stored entries (lower triangle with diagonal).
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Where each column starts in [`Self::rows`].
    pub fn column_starts(&self) -> &[u32] {
        &self.column_starts
    }

    /// Row indices of all columns, one column after the other, ascending in each.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Places of one column's entries.
    pub(super) fn column(&self, column: usize) -> std::ops::Range<usize> {
        self.column_starts[column] as usize..self.column_starts[column + 1] as usize
    }

    /// Place of the entry (`row`, `column`), `row ≥ column`.
    pub(super) fn place(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.column(column);
        let found = self.rows[range.clone()].binary_search(&u32::try_from(row).ok()?).ok()?;
        Some(range.start + found)
    }
}

/// For each unknown the elements that list it, as starts and one flat list.
fn elements_of_unknowns<'a>(
    n: usize,
    elements: impl Iterator<Item = &'a [u32]> + Clone,
) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0_usize; n + 1];
    for &unknown in elements.clone().flatten() {
        starts[unknown as usize + 1] += 1;
    }
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut owners = vec![0_u32; starts[n]];
    let mut next = starts.clone();
    for (element, list) in elements.enumerate() {
        for &unknown in list {
            owners[next[unknown as usize]] = element as u32;
            next[unknown as usize] += 1;
        }
    }
    (starts, owners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lower_triangle_of_two_elements_that_share_an_unknown() {
        let elements: [&[u32]; 2] = [&[3, 0], &[4, 1, 3]];
        let pattern = Pattern::from_elements(6, elements.into_iter());
        assert_eq!(pattern.column_starts(), [0, 2, 5, 6, 8, 9, 10]);
        assert_eq!(pattern.rows(), [0, 3, 1, 3, 4, 2, 3, 4, 4, 5]);
        assert_eq!((pattern.dimension(), pattern.entries()), (6, 10));
        assert_eq!(pattern.place(4, 3), Some(7));
        assert_eq!(pattern.place(4, 0), None);
    }

    #[test]
    fn unknowns_of_the_same_elements_share_their_neighbours() {
        let elements: [&[u32]; 2] = [&[0, 1, 2, 3], &[2, 3, 4, 5]];
        let pattern = Pattern::from_elements(6, elements.into_iter());
        let full: Vec<Vec<u32>> = (0..6).map(|c| pattern.rows()[pattern.column(c)].to_vec()).collect();
        assert_eq!(
            full,
            [vec![0, 1, 2, 3], vec![1, 2, 3], vec![2, 3, 4, 5], vec![3, 4, 5], vec![4, 5], vec![5]]
        );
    }
}

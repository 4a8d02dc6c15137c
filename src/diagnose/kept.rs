//! The last few things that were worked out, for whoever asks for them again.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Keeps `MOST` at the most; the oldest goes first.
pub(super) struct Kept<T, const MOST: usize>(Mutex<VecDeque<Arc<T>>>);

impl<T, const MOST: usize> Default for Kept<T, MOST> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T, const MOST: usize> Kept<T, MOST> {
    /// The one that is asked for, made where it is not kept. Others may ask meanwhile, and make the same.
    ///
    /// # Errors
    /// What `make` says; nothing is kept then.
    pub(super) fn get<E>(
        &self,
        asked: impl Fn(&T) -> bool,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        // A panic elsewhere leaves whole entries only.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let find = |kept: &VecDeque<Arc<T>>| kept.iter().find(|known| asked(known)).map(Arc::clone);
        if let Some(known) = find(&kept()) {
            return Ok(known);
        }
        let made = Arc::new(make()?);
        let mut kept = kept();
        // Who made the same meanwhile must not cost another its place.
        if let Some(known) = find(&kept) {
            return Ok(known);
        }
        if kept.len() == MOST {
            kept.pop_front();
        }
        kept.push_back(Arc::clone(&made));
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is kept is not made again; the oldest of three is, once two others were; and what failed is asked for again.
    #[test]
    fn the_last_are_kept() {
        let kept = Kept::<i32, 2>::default();
        let mut made = Vec::new();
        let mut get = |n: i32| {
            let make = || {
                made.push(n);
                if n < 0 { Err("no such number") } else { Ok(n) }
            };
            kept.get(|known| *known == n, make).map(|found| *found)
        };
        for n in [1, 2, 1, 2, 3, 2, 3, 1] {
            assert_eq!(get(n), Ok(n));
        }
        assert_eq!([get(-1), get(-1)], [Err("no such number"); 2]);
        assert_eq!(made, [1, 2, 3, 1, -1, -1]);
    }

    /// Asked for again while it is made, as another thread may: kept once, and what was kept before stays.
    #[test]
    fn what_is_made_twice_is_kept_once() {
        let kept = Kept::<i32, 2>::default();
        let get = |n: i32| kept.get(|known| *known == n, || Ok::<_, ()>(n)).map(|found| *found);
        assert_eq!(get(1), Ok(1));
        let twice = kept.get(|known| *known == 2, || get(2));
        assert_eq!(twice.map(|found| *found), Ok(2));
        let known = kept.get(|known| *known == 1, || Err("not kept"));
        assert_eq!(known.map(|found| *found), Ok(1));
    }
}

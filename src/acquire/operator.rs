//! The person at the bench: what was asked, and whether it was agreed to.

use std::sync::atomic::{AtomicBool, Ordering};

/// One question at a time. Whoever shows the question answers it; the run waits and keeps the stage alive meanwhile.
#[derive(Debug, Default)]
pub struct Operator {
    agreed: AtomicBool,
}

impl Operator {
    /// The person agrees to what is asked now.
    pub fn agree(&self) {
        self.agreed.store(true, Ordering::Release);
    }

    /// A new question: what was agreed to before does not count.
    pub(super) fn ask(&self) {
        self.agreed.store(false, Ordering::Release);
    }

    /// Whether it was agreed to.
    pub(super) fn has_agreed(&self) -> bool {
        self.agreed.load(Ordering::Acquire)
    }
}

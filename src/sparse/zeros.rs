//! Memory for what is added to.

/// So many zeros, written. Memory that is promised to be zero and read before it is written faults twice, and the second fault stops every
/// thread: adding to it costs several times what writing it first does.
pub(super) fn zeros(count: usize) -> Vec<f64> {
    // What is not known to be new is not taken from the promise.
    let mut zeros = std::hint::black_box(Vec::with_capacity(count));
    zeros.resize(count, 0.0);
    zeros
}

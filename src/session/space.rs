//! How much room on the disk a session needs, so that it can be seen before it begins whether there is enough.

use super::message::BATCH;
use super::scribe::CHUNK_SPAN;

/// What is recorded how often.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rates {
    /// Force records a second.
    pub force_hz: f64,
    /// Reports of the stage a second.
    pub stage_hz: f64,
    /// Frames of marker positions a second.
    pub frames_hz: f64,
    /// Markers in a frame.
    pub markers: u32,
}

/// Message record, its header, its entry in the index of its chunk.
const MESSAGE: f64 = 9.0 + 22.0 + 16.0;

/// Chunk record with its header, three indexes of topics, and its entry in the index of the file.
const CHUNK: f64 = 49.0 + 3.0 * 15.0 + 120.0;

/// Header, number of the first record, lengths of ten columns with what aligns them; then the columns.
const BATCH_FIXED: f64 = 4.0 + 8.0 + 10.0 * 4.0 + 4.0;
const RECORD: f64 = 8.0 + 3.0 * 4.0 + 6.0 * 4.0;

const REPORT: f64 = 4.0 + 35.0;

const FRAME_FIXED: f64 = 4.0 + 12.0 + 4.0 * 8.0;
const MARKER: f64 = 4.0 + 3.0 * 8.0;

/// Bytes a second that a session grows by, events apart.
pub fn bytes_per_second(rates: Rates) -> f64 {
    // A batch lasts 10 ms at most.
    let records_a_batch = (rates.force_hz * 0.01).clamp(1.0, BATCH as f64);
    let force = rates.force_hz * (RECORD + (MESSAGE + BATCH_FIXED) / records_a_batch);
    let stage = rates.stage_hz * (MESSAGE + REPORT);
    let markers = rates.frames_hz * (MESSAGE + FRAME_FIXED + f64::from(rates.markers) * MARKER);
    force + stage + markers + CHUNK / CHUNK_SPAN.as_secs_f64()
}

//! How well diagnoses answer recordings whose answers were concealed: every draw judged, and the sums.
//!
//! An [`Answer`] is what was concealed, a [`Said`] what the diagnosis said, both as they were written to disk; [`judge`]
//! compares the two, [`Scorecard::of`] counts. Nothing here knows how recordings are made or diagnosed.

mod aliases;
mod answer;
mod bins;
mod draw_text;
mod errors;
mod judge;
mod page;
mod said;
mod table;
mod tally;
mod text;

pub use answer::{Answer, Figure};
pub use bins::{Bin, calibration_error, reliability};
pub use draw_text::draw_text;
pub use errors::ParameterError;
pub use judge::{Draw, Judged, Kind, Outcome, judge};
pub use page::scorecard_page;
pub use said::{Number, Said, Verdict, Weighed};
pub use table::scorecard_table;
pub use tally::{Coverage, Limit, Line, Scorecard, Share, Spread};
pub use text::scorecard_text;

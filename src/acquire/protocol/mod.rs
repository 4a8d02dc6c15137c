//! What a technician asks the bench to do: a protocol file, read and checked for all that needs no bench.
//!
//! ```toml
//! format = "phantom-protocol/1"
//! name = "five pokes"
//! [variables]
//! deep_mm = 3                    # the name ends in the unit; "--set deep_mm=4" replaces the value
//! [defaults]                     # for every step that does not say otherwise
//! speed_mm_s = 2
//! [[step]]
//! kind = "poke"
//! site_mm = [50, 75, 25]         # phantom frame
//! depth_mm = "$deep_mm"
//! ```
//!
//! | kind | keys besides those of its group | group |
//! | --- | --- | --- |
//! | `poke` | `site_mm` | motion, press |
//! | `grid` | `origin_mm`, `along`, `spacing_mm` and `counts` or `first_mm` and `second_mm`, `order`, `seed` | motion, press |
//! | `cycles` | `site_mm`, `offset_mm`, `amplitude_mm`, `cycles` | motion |
//! | `air` | `site_mm`, `depth_mm`, `hold_s`, `repeats` | motion |
//! | `wait` | `wait_s` | |
//! | `mark`, `ask` | `text` | |
//!
//! Group *motion*: `speed_mm_s`, `retreat_speed_mm_s` (the same), `direction` (straight in), `pause_s` (1). Group *press*: `depth_mm`,
//! or `until_force_n` with `depth_limit_mm`; `hold_s` (0), `repeats` (1). In brackets what holds where the file is silent.
//!
//! Reading opens no file, and what is refused is refused with file, line, key, value and expectation: [`Refusal`].

mod expand;
mod grid;
mod listed;
mod quantity;
mod read;
mod refusal;
#[cfg(test)]
mod refusals;
mod section;
mod step;
mod steps;

pub use expand::{Action, PlannedStep, StepId, from_poke};
pub use listed::ListedPoke;
pub use read::FORMAT;
pub use refusal::{Problem, Refusal};
pub use steps::{Kind, MOST_STROKES, Place, Profile, Protocol, Step, Stroke, Target, Task, Variable};

//! The page: one HTML file that needs nothing but itself.
//!
//! The page carries its data as two JSON blocks (the three-dimensional view, the plots) and draws them with the
//! plotting library that is built into the program. A content security policy in the page forbids every
//! request, so that it shows the same with and without a network. Text that comes from the recording is escaped.

mod figures;
mod html;
mod scale;
mod scene;
mod series;
mod skin;
mod thin;

pub(super) use figures::{remarks, settings_table, table};
pub use html::page;
pub(super) use html::{escape, json_block, whole};
pub(super) use skin::{Columns, DiscScene, Skin, Triangles, millimetres, rounded};
pub(super) use thin::thin;

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
mod thin;

pub use html::page;

//! Is the mathematics right: derivatives against differences, solutions against closed forms, rates against
//! theory. One module a topic.

mod material_closed_forms;
mod material_derivatives;

//! Is the mathematics right: derivatives against differences, solutions against closed forms, rates against
//! theory. One module a topic.

mod bodies;
mod finite_closed_forms;
mod finite_newton;
mod finite_sensitivities;
mod material_closed_forms;
mod material_derivatives;

//! Is the mathematics right: derivatives against differences, solutions against closed forms, rates against
//! theory. One module a topic.

mod bodies;
mod finite_closed_forms;
mod finite_incompressible;
mod finite_newton;
mod finite_practice;
mod finite_sensitivities;
mod finite_stability;
mod material_closed_forms;
mod material_derivatives;

//! Is the mathematics right: derivatives against differences, solutions against closed forms, rates against
//! theory. One module a topic.

mod bodies;
mod finite_closed_forms;
mod finite_incompressible;
mod finite_newton;
mod finite_practice;
mod finite_sensitivities;
mod finite_stability;
mod linear_beams;
mod linear_exactness;
mod linear_fields;
mod linear_half_space;
mod linear_mesh;
mod linear_reciprocity;
mod linear_system;
mod linear_tips;
mod material_closed_forms;
mod material_derivatives;

//! Does the whole chain do what its parts promise. One module a topic.

mod jacobian;

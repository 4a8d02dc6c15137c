//! A bench with physics of its own.

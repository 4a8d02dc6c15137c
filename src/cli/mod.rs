//! What was typed, and the exit code.

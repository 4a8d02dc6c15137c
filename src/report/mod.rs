//! What a person should see.

//! What bytes are recognised by.
//!
//! | question | answer |
//! | --- | --- |
//! | are these the bytes that they were? | [`sha256_hex`] |

mod sha256;

pub use sha256::sha256_hex;

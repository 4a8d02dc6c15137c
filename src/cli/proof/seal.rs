//! Hashes and seals: SHA-256 (FIPS 180-4), ChaCha20-Poly1305 (RFC 8439).

use super::ProofError;
use chacha20poly1305::aead::{Aead, KeyInit, Payload};
use chacha20poly1305::{ChaCha20Poly1305, Nonce};
use sha2::{Digest, Sha256};

/// Bytes of the nonce at the head of what is sealed.
const NONCE: usize = 12;

/// SHA-256 of a purpose and of parts, each with its length before it, so that no two lists give the same bytes.
pub(in crate::cli) fn digest(purpose: &str, parts: &[&[u8]]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for part in std::iter::once(purpose.as_bytes()).chain(parts.iter().copied()) {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash.finalize().into()
}

/// Two hexadecimal digits a byte.
pub(in crate::cli) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// What opens the answers of one proof.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::cli) struct Seal([u8; 32]);

impl Seal {
    /// The seal that belongs to a seed, so that draws can be gone on with.
    pub(in crate::cli) fn of_seed(seed: u64) -> Self {
        Self(digest("phantom-rig seal", &[&seed.to_le_bytes()]))
    }

    /// As the key file has it.
    pub(in crate::cli) fn text(&self) -> String {
        hex(&self.0) + "\n"
    }

    /// From a key file.
    pub(in crate::cli) fn of_text(text: &str) -> Option<Self> {
        let text = text.trim();
        if text.len() != 64 || !text.is_ascii() {
            return None;
        }
        let mut key = [0; 32];
        for (i, byte) in key.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * i..2 * i + 2], 16).ok()?;
        }
        Some(Self(key))
    }

    /// Seals the answer of a draw.
    ///
    /// The nonce is a hash of the answer: it repeats only where the answer does.
    pub(in crate::cli) fn close(&self, draw: &str, answer: &[u8]) -> Result<Vec<u8>, ProofError> {
        let mut nonce = [0; NONCE];
        nonce.copy_from_slice(&digest("phantom-rig nonce", &[&self.0, draw.as_bytes(), answer])[..NONCE]);
        let payload = Payload { msg: answer, aad: draw.as_bytes() };
        let sealed = self.cipher().encrypt(&Nonce::from(nonce), payload);
        let sealed = sealed.map_err(|_| ProofError::Sealed { draw: draw.to_owned() })?;
        Ok([&nonce, sealed.as_slice()].concat())
    }

    /// Opens what [`close`](Self::close) sealed.
    ///
    /// # Errors
    /// [`ProofError::Sealed`]: another key, another draw's, or changed since.
    pub(in crate::cli) fn open(&self, draw: &str, sealed: &[u8]) -> Result<Vec<u8>, ProofError> {
        let refused = || ProofError::Sealed { draw: draw.to_owned() };
        let (nonce, text) = sealed.split_first_chunk::<NONCE>().ok_or_else(refused)?;
        let payload = Payload { msg: text, aad: draw.as_bytes() };
        self.cipher().decrypt(&Nonce::from(*nonce), payload).map_err(|_| refused())
    }

    fn cipher(&self) -> ChaCha20Poly1305 {
        ChaCha20Poly1305::new(&self.0.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FIPS 180-4's example: SHA-256 of "abc".
    #[test]
    fn the_hash_is_sha_256() {
        let bytes: [u8; 32] = Sha256::digest(b"abc").into();
        assert_eq!(hex(&bytes), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        assert_ne!(digest("a", &[b"bc"]), digest("a", &[b"b", b"c"]));
        assert_ne!(digest("a", &[b"b"]), digest("ab", &[b""]));
    }

    #[test]
    fn a_seal_opens_with_its_key_for_its_draw_and_unchanged_only() {
        let seal = Seal::of_seed(7);
        assert_eq!(Seal::of_text(&seal.text()), Some(seal.clone()));
        assert_eq!(Seal::of_text("no key"), None);
        let mut sealed = seal.close("draw-0001", b"nothing").expect("sealed");
        assert!(!sealed.windows(7).any(|w| w == b"nothing"));
        assert_eq!(seal.open("draw-0001", &sealed).expect("open"), b"nothing");
        assert!(seal.open("draw-0002", &sealed).is_err());
        assert!(Seal::of_seed(8).open("draw-0001", &sealed).is_err());
        assert!(seal.open("draw-0001", b"short").is_err());
        let last = sealed.len() - 1;
        sealed[last] ^= 1;
        assert!(seal.open("draw-0001", &sealed).is_err());
    }
}

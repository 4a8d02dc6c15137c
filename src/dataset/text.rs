//! Which bytes are text that this room reads: UTF-8, with or without a byte order mark.

/// The UTF-8 byte order mark, which some programs write before the first character.
pub(super) const BOM: &[u8] = b"\xef\xbb\xbf";

/// Whether the first bytes of a text look like UTF-16: a byte order mark of it, or every second byte zero.
pub(super) fn is_utf16(start: &[u8]) -> bool {
    if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
        return true;
    }
    let pairs = start.chunks_exact(2).take(8);
    pairs.len() >= 2
        && (pairs.clone().all(|p| p[0] == 0 && p[1] != 0) || pairs.clone().all(|p| p[0] != 0 && p[1] == 0))
}

/// The bytes after the byte order mark, if there is one.
pub(super) fn without_bom(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BOM).unwrap_or(bytes)
}

/// Line (from 1) that holds the byte at `at`.
pub(super) fn line_of(bytes: &[u8], at: usize) -> u64 {
    1 + bytes[..at.min(bytes.len())].iter().filter(|&&b| b == b'\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utf16_is_told_from_utf8_with_and_without_its_mark() {
        let text = "t_s,x_m\n0,1\n";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert!(is_utf16(&little) && is_utf16(&big) && is_utf16(b"\xff\xfet\0"));
        assert!(!is_utf16(text.as_bytes()) && !is_utf16(b"") && !is_utf16(b"\xef\xbb\xbft_s"));
    }
}

//! How numbers become bytes and back: Common Data Representation, little-endian, as ROS 2 writes it.
//!
//! A message is a header of four bytes, then the fields in their order. A primitive of n bytes begins at a multiple of n, counted from
//! after the header; a sequence is its length (u32), then its elements; a string is a sequence of bytes that ends with a zero.
//!
//! Why by hand: five fixed types need six primitives. Decoding into arrays of fixed size, without allocation and with every length
//! checked against the bytes that are there, is shorter here than describing the same to a general serialiser.

/// Plain CDR, little-endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Writes one message.
pub(super) struct Encoder<'a> {
    bytes: &'a mut Vec<u8>,
}

impl<'a> Encoder<'a> {
    /// Begins a message; what `bytes` held is gone, its room is used again.
    pub(super) fn new(bytes: &'a mut Vec<u8>) -> Self {
        bytes.clear();
        bytes.extend_from_slice(&HEADER);
        Self { bytes }
    }

    fn primitive<const N: usize>(&mut self, value: [u8; N]) {
        let behind = (self.bytes.len() - HEADER.len()) % N;
        if behind > 0 {
            self.bytes.resize(self.bytes.len() + N - behind, 0);
        }
        self.bytes.extend_from_slice(&value);
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.primitive([value]);
    }

    pub(super) fn bool(&mut self, value: bool) {
        self.u8(u8::from(value));
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.primitive(value.to_le_bytes());
    }

    pub(super) fn u64(&mut self, value: u64) {
        self.primitive(value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.primitive(value.to_le_bytes());
    }

    /// A sequence, its elements given as bytes.
    pub(super) fn sequence<const N: usize>(&mut self, values: impl ExactSizeIterator<Item = [u8; N]>) {
        self.length(values.len());
        for value in values {
            self.primitive(value);
        }
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.length(bytes.len());
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn string(&mut self, value: &str) {
        self.length(value.len() + 1);
        self.bytes.extend_from_slice(value.as_bytes());
        self.bytes.push(0);
    }

    /// A length. What is recorded is far below 2³² elements; a longer one would not decode again.
    fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).unwrap_or(u32::MAX));
    }
}

/// Reads one message; every answer is `None` where the bytes do not hold what was asked for.
pub(super) struct Decoder<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Option<Self> {
        Some(Self { body: bytes.strip_prefix(&HEADER)?, at: 0 })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.body.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    fn primitive<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(N);
        self.take(N)?.try_into().ok()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.primitive().map(u8::from_le_bytes)
    }

    pub(super) fn bool(&mut self) -> Option<bool> {
        match self.u8()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.primitive().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.primitive().map(u64::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.primitive().map(f64::from_le_bytes)
    }

    /// The elements of a sequence as bytes.
    pub(super) fn sequence<const N: usize>(
        &mut self,
    ) -> Option<impl ExactSizeIterator<Item = [u8; N]> + use<'a, N>> {
        let length = self.u32()? as usize;
        if length > 0 {
            self.at = self.at.next_multiple_of(N);
        }
        let elements = self.take(length.checked_mul(N)?)?;
        let (elements, _) = elements.as_chunks::<N>();
        Some(elements.iter().copied())
    }

    /// The elements of a sequence of bytes.
    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.u32()?).ok()?;
        self.take(length)
    }

    pub(super) fn string(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        let text = self.take(length)?.strip_suffix(&[0])?;
        String::from_utf8(text.to_vec()).ok()
    }

    /// Whether all bytes were read.
    pub(super) fn end(self) -> Option<()> {
        (self.at == self.body.len()).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the rules above, by hand: a u8, then a u32 at 4, then a u64 at 8, an empty sequence of u64 without padding after its length,
    /// and a string.
    #[test]
    fn primitives_begin_at_multiples_of_their_size() {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes);
        encoder.u8(7);
        encoder.u32(0x0102_0304);
        encoder.u64(5);
        encoder.sequence([0_u64; 0].into_iter().map(u64::to_le_bytes));
        encoder.string("ab");
        let expected = [
            0, 1, 0, 0, // header
            7, 0, 0, 0, 4, 3, 2, 1, 5, 0, 0, 0, 0, 0, 0, 0, // u8, padding, u32, u64
            0, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0, // empty sequence, string
        ];
        assert_eq!(bytes, expected);

        let mut decoder = Decoder::new(&bytes).expect("a header");
        assert_eq!((decoder.u8(), decoder.u32(), decoder.u64()), (Some(7), Some(0x0102_0304), Some(5)));
        assert_eq!(decoder.sequence::<8>().map(|s| s.len()), Some(0));
        assert_eq!(decoder.string().as_deref(), Some("ab"));
        assert_eq!(decoder.end(), Some(()));
    }

    #[test]
    fn lengths_that_lie_are_refused() {
        let mut bytes = HEADER.to_vec();
        bytes.extend_from_slice(&u32::MAX.to_le_bytes());
        assert!(Decoder::new(&bytes).expect("a header").sequence::<8>().is_none());
        assert!(Decoder::new(&bytes).expect("a header").string().is_none());
        assert!(Decoder::new(&[0, 0, 0, 0]).is_none(), "big-endian");
        assert_eq!(Decoder::new(&bytes).expect("a header").end(), None);
    }
}

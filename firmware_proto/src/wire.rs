//! How does one value lie in a payload? Little-endian, packed, without alignment or padding.
//!
//! Why little-endian: both ends are, so that a dump reads like memory; nothing else depends on it.

/// A value with a fixed place on the wire.
pub(crate) trait Wire: Sized {
    /// How tables and the schema hash call the type.
    const NAME: &'static str;
    /// Bytes on the wire.
    const SIZE: usize;
    fn put(&self, to: &mut Writer<'_>);
    /// `None` when bytes are missing or mean nothing.
    fn get(from: &mut Reader<'_>) -> Option<Self>;
}

/// Writes from the front of a buffer. What does not fit is left out: the tables are checked against the
/// longest payload when they are compiled.
pub(crate) struct Writer<'a> {
    into: &'a mut [u8],
    length: usize,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(into: &'a mut [u8]) -> Self {
        Self { into, length: 0 }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        let end = self.length.saturating_add(bytes.len());
        if let Some(place) = self.into.get_mut(self.length..end) {
            place.copy_from_slice(bytes);
            self.length = end;
        }
    }

    /// Bytes written so far.
    pub(crate) fn length(&self) -> usize {
        self.length
    }
}

/// Reads from the front of a buffer.
pub(crate) struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }

    /// Whether every byte was used: a payload longer than its layout is refused like one too short.
    pub(crate) fn is_used_up(&self) -> bool {
        self.0.is_empty()
    }
}

macro_rules! number {
    ($($type:ident)+) => {$(
        impl Wire for $type {
            const NAME: &'static str = stringify!($type);
            const SIZE: usize = size_of::<$type>();
            fn put(&self, to: &mut Writer<'_>) {
                to.bytes(&self.to_le_bytes());
            }
            fn get(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self::from_le_bytes(from.array()?))
            }
        }
    )+};
}

number! { u8 u16 u32 u64 i32 i64 }

/// The same quantity of both axes, axis 0 first.
impl Wire for [i32; 2] {
    const NAME: &'static str = "2 × i32";
    const SIZE: usize = 8;
    fn put(&self, to: &mut Writer<'_>) {
        self.iter().for_each(|value| value.put(to));
    }
    fn get(from: &mut Reader<'_>) -> Option<Self> {
        Some([i32::get(from)?, i32::get(from)?])
    }
}

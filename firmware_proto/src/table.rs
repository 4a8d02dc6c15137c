//! What does the protocol's table hold, and which number tells two tables apart?
//!
//! The macros here turn one written list into the Rust types, their coding, the rows that the documentation
//! prints and the bytes that the schema hash covers, so that none of the four can differ from another.

/// One field of a message or record, in the order of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name as in the Rust type.
    pub name: &'static str,
    /// Type on the wire: a number, a code list or a record.
    pub kind: &'static str,
    /// Bytes on the wire.
    pub bytes: usize,
    /// Unit, "–" where there is none.
    pub unit: &'static str,
    /// What it means, for readers only: not part of the schema hash.
    pub meaning: &'static str,
}

/// A message: what follows the header of a frame with this kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Kind byte of the frame.
    pub kind: u8,
    /// Name as in the Rust type.
    pub name: &'static str,
    /// What it is for; not part of the schema hash.
    pub meaning: &'static str,
    /// Fields of the payload.
    pub fields: &'static [Field],
}

/// A group of fields that several messages share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Name as in the Rust type.
    pub name: &'static str,
    /// Its fields.
    pub fields: &'static [Field],
}

/// One value of a code list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// Byte on the wire.
    pub code: u8,
    /// Name as in the Rust type.
    pub name: &'static str,
    /// What it means; not part of the schema hash.
    pub meaning: &'static str,
}

/// A list of codes, one byte each on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CodeList {
    /// Name as in the Rust type.
    pub name: &'static str,
    /// Its values.
    pub codes: &'static [Code],
}

/// An enum of one byte, with its list.
macro_rules! codes {
    ($(#[doc = $doc:literal])+ $name:ident {
        $($(#[doc = $meaning:literal])+ $variant:ident = $code:literal),+ $(,)?
    }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name { $($(#[doc = $meaning])+ $variant = $code),+ }

        impl $name {
            /// The list as the documentation prints it and the schema hash covers it.
            pub const CODES: CodeList = CodeList {
                name: stringify!($name),
                codes: &[$(Code {
                    code: $code,
                    name: stringify!($variant),
                    meaning: concat!($($meaning),+),
                }),+],
            };

            /// The value with this byte on the wire, if there is one.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)+ _ => None }
            }
        }

        impl Wire for $name {
            const NAME: &'static str = stringify!($name);
            const SIZE: usize = 1;
            fn put(&self, to: &mut Writer<'_>) {
                to.bytes(&[*self as u8]);
            }
            fn get(from: &mut Reader<'_>) -> Option<Self> {
                Self::from_code(u8::get(from)?)
            }
        }
    };
}

/// A struct of fields, with its layout.
macro_rules! record {
    ($(#[doc = $doc:literal])+ $name:ident {
        $($(#[doc = $meaning:literal])+ $field:ident: $type:ty, $unit:literal);+ $(;)?
    }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name { $($(#[doc = $meaning])+ pub $field: $type),+ }

        impl $name {
            /// The layout as the documentation prints it and the schema hash covers it.
            pub const LAYOUT: Record = Record {
                name: stringify!($name),
                fields: &[$(Field {
                    name: stringify!($field),
                    kind: <$type as Wire>::NAME,
                    bytes: <$type as Wire>::SIZE,
                    unit: $unit,
                    meaning: concat!($($meaning),+),
                }),+],
            };
        }

        impl Wire for $name {
            const NAME: &'static str = stringify!($name);
            const SIZE: usize = 0 $(+ <$type as Wire>::SIZE)+;
            fn put(&self, to: &mut Writer<'_>) {
                $(self.$field.put(to);)+
            }
            fn get(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self { $($field: Wire::get(from)?),+ })
            }
        }
    };
}

/// An enum of messages going one way, with its table, coder and decoder.
macro_rules! messages {
    ($(#[doc = $doc:literal])+ $name:ident {
        $($(#[doc = $purpose:literal])+ $variant:ident = $kind:literal {
            $($(#[doc = $meaning:literal])+ $field:ident: $type:ty, $unit:literal);* $(;)?
        })+
    }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($(#[doc = $purpose])+ $variant { $($(#[doc = $meaning])+ $field: $type),* }),+ }

        impl $name {
            /// The table as the documentation prints it and the schema hash covers it.
            pub const TABLE: &'static [Layout] = &[$(Layout {
                kind: $kind,
                name: stringify!($variant),
                meaning: concat!($($purpose),+),
                fields: &[$(Field {
                    name: stringify!($field),
                    kind: <$type as Wire>::NAME,
                    bytes: <$type as Wire>::SIZE,
                    unit: $unit,
                    meaning: concat!($($meaning),+),
                }),*],
            }),+];

            /// Kind byte of the frame.
            #[must_use]
            pub const fn kind(&self) -> u8 {
                match self { $(Self::$variant { .. } => $kind),+ }
            }

            /// The message as a frame, delimiter included.
            #[must_use]
            pub fn encode(&self, stamp: Stamp) -> Encoded {
                let mut payload = [0; MAX_PAYLOAD];
                let mut to = Writer::new(&mut payload);
                match self { $(Self::$variant { $($field),* } => { $($field.put(&mut to);)* }),+ }
                let length = to.length();
                Encoded::of(MAJOR, self.kind(), stamp, &payload[..length])
            }

            /// The message in a frame.
            ///
            /// # Errors
            /// When the table has no such kind, or the payload is not what the table says.
            pub fn decode(frame: &Frame<'_>) -> Result<Self, Undecodable> {
                let bad = Undecodable::BadPayload { kind: frame.kind, bytes: frame.payload.len() };
                let mut from = Reader::new(frame.payload);
                let message = match frame.kind {
                    $($kind => Self::$variant { $($field: <$type as Wire>::get(&mut from).ok_or(bad)?),* },)+
                    kind => return Err(Undecodable::UnknownKind { kind }),
                };
                if from.is_used_up() { Ok(message) } else { Err(bad) }
            }
        }

        const _: () = assert!(longest($name::TABLE) <= MAX_PAYLOAD, "a message exceeds the longest frame");
    };
}

pub(crate) use {codes, messages, record};

/// Bytes of the longest payload in a table.
pub(crate) const fn longest(table: &[Layout]) -> usize {
    let (mut most, mut row) = (0, 0);
    while row < table.len() {
        let (mut bytes, mut column) = (0, 0);
        while column < table[row].fields.len() {
            bytes += table[row].fields[column].bytes;
            column += 1;
        }
        if bytes > most {
            most = bytes;
        }
        row += 1;
    }
    most
}

/// FNV-1a with 64 bits (Fowler, Noll and Vo's published offset basis and prime for 64 bits), const-evaluated.
///
/// Why not the frame's CRC: a CRC of 32 bits lets one pair of different tables in 4·10⁹ pass, and this number
/// is only ever worked out by the compiler.
#[derive(Clone, Copy)]
pub(crate) struct Hash(pub(crate) u64);

impl Hash {
    pub(crate) const START: Self = Self(0xcbf2_9ce4_8422_2325);
    const PRIME: u64 = 0x0000_0100_0000_01b3;

    pub(crate) const fn byte(self, byte: u8) -> Self {
        Self((self.0 ^ byte as u64).wrapping_mul(Self::PRIME))
    }

    /// A text and its end, so that "ab", "c" differs from "a", "bc".
    pub(crate) const fn text(mut self, text: &str) -> Self {
        let mut at = 0;
        while at < text.len() {
            self = self.byte(text.as_bytes()[at]);
            at += 1;
        }
        self.byte(0)
    }

    pub(crate) const fn fields(mut self, fields: &[Field]) -> Self {
        let mut at = 0;
        while at < fields.len() {
            let field = &fields[at];
            self = self.text(field.name).text(field.kind).byte(field.bytes as u8).text(field.unit);
            at += 1;
        }
        self.byte(0)
    }

    pub(crate) const fn messages(mut self, table: &[Layout]) -> Self {
        let mut at = 0;
        while at < table.len() {
            self = self.byte(table[at].kind).text(table[at].name).fields(table[at].fields);
            at += 1;
        }
        self
    }

    pub(crate) const fn records(mut self, records: &[Record]) -> Self {
        let mut at = 0;
        while at < records.len() {
            self = self.text(records[at].name).fields(records[at].fields);
            at += 1;
        }
        self
    }

    pub(crate) const fn lists(mut self, lists: &[CodeList]) -> Self {
        let mut list = 0;
        while list < lists.len() {
            self = self.text(lists[list].name);
            let mut at = 0;
            while at < lists[list].codes.len() {
                self = self.byte(lists[list].codes[at].code).text(lists[list].codes[at].name);
                at += 1;
            }
            list += 1;
        }
        self
    }
}

//! What a bit of the status word says, and which bits must stop the motion. It depends on the product: bits 0–5 and 27–30 of an
//! Ethernet Axia mean something else than those of a Net Box.
//!
//! Sources: ATI 9620-05, section "System status code" (Net Box); 9610-05, p. 37 (Axia).
//!
//! # Which bits stop
//! Whatever makes a reading doubtful, whatever is not known, and the threshold: somebody set a limit on the sensor, and it was
//! crossed. A latched threshold leaves the readings themselves good, so that the word of a Net Box with nothing but the latch,
//! `0x8001_0000`, is a warning to whoever reads forces; to whoever moves it is a reason to stand still until a person has let go of
//! the latch.
//!
//! Of a Net Box four bits are left out that say nothing of the readings: the interfaces HTTP, CAN, EtherNet/IP and DeviceNet, which
//! are not read here. Its bit 31 sums up all others, those four as well, and therefore cannot be in the mask either. An Axia has no
//! such bits; there every bit stops.

/// A family of sensors that share the meaning of a status word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetFtProduct {
    /// Net Box with a transducer.
    NetBox,
    /// Ethernet Axia.
    Axia,
    /// The page does not tell.
    Unknown,
}

/// Set whenever any other bit is.
const SUMMARY: u32 = 1 << 31;

/// Bits of a Net Box that say nothing of its readings: HTTP, DeviceNet, EtherNet/IP, CAN.
const NET_BOX_ASIDE: u32 = 1 << 1 | 1 << 18 | 1 << 19 | 1 << 21;

const NET_BOX: [(u32, &str); 29] = [
    (30, "processor or memory error"),
    (29, "digital board error"),
    (28, "analogue board error"),
    (27, "serial link between digital and analogue board failed"),
    (26, "program memory verification failed"),
    (25, "halted by its configuration"),
    (24, "settings checksum wrong"),
    (23, "configuration does not fit the calibration of this transducer"),
    (22, "network error"),
    (21, "CAN bus error (not used here)"),
    (20, "RDT error"),
    (19, "EtherNet/IP error (not used here)"),
    (18, "DeviceNet error (not used here)"),
    (17, "transducer saturated or its cable faulty: force or torque beyond the range, the reading is wrong"),
    (16, LATCHED),
    (14, "watchdog time-out"),
    (13, "stack check failed"),
    (12, "serial EEPROM failed"),
    (11, "flash memory failed"),
    (10, "analogue board watchdog time-out"),
    (9, "excitation of the strain gauges too high"),
    (8, "excitation of the strain gauges too low"),
    (7, "artificial analogue ground out of range"),
    (6, "supply voltage too high"),
    (5, "supply voltage too low"),
    (4, "serial link data missing"),
    (3, "reference voltage out of range"),
    (2, "temperature out of range"),
    (1, "web server error (not used for readings)"),
];

const AXIA: [(u32, &str); 10] = [
    (30, "force or torque out of range: the reading is wrong"),
    (29, "calibration checksum wrong"),
    (28, "simulated error: somebody is testing the error handling"),
    (27, "a strain gauge out of range: the reading is wrong"),
    (16, LATCHED),
    (5, "another error"),
    (3, "busy: readings are not valid"),
    (2, "broken strain gauge"),
    (1, "supply voltage out of range"),
    (0, "temperature out of range"),
];

const LATCHED: &str =
    "a threshold was crossed and is latched: readings are good, the limit set on the sensor was exceeded";

impl NetFtProduct {
    /// Status bits on which no motion may go on.
    pub fn stop_mask(self) -> u32 {
        match self {
            Self::NetBox => !(SUMMARY | NET_BOX_ASIDE),
            Self::Axia | Self::Unknown => u32::MAX,
        }
    }

    /// What the bits of a status word say.
    pub fn explain(self, status: u32) -> Vec<&'static str> {
        let known: &[(u32, &str)] = match self {
            Self::NetBox => &NET_BOX,
            Self::Axia => &AXIA,
            Self::Unknown => &[(16, LATCHED)],
        };
        let mut rest = status & !SUMMARY;
        let mut said = Vec::new();
        for &(bit, meaning) in known {
            if rest >> bit & 1 == 1 {
                said.push(meaning);
                rest &= !(1 << bit);
            }
        }
        if rest != 0 {
            said.push(if self == Self::Unknown {
                "an error whose meaning depends on the product, which the sensor does not name"
            } else {
                "an error that the manual does not name"
            });
        }
        if said.is_empty() && status != 0 {
            said.push("an error that the sensor does not name");
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::NetFtProduct::{Axia, NetBox, Unknown};
    use super::*;

    #[test]
    fn a_sound_sensor_says_nothing() {
        for product in [NetBox, Axia, Unknown] {
            assert!(product.explain(0).is_empty());
        }
    }

    #[test]
    fn the_same_bit_is_explained_by_product() {
        assert_eq!(NetBox.explain(1 << 31 | 1 << 1), ["web server error (not used for readings)"]);
        assert_eq!(Axia.explain(1 << 31 | 1 << 1), ["supply voltage out of range"]);
        assert!(NetBox.explain(0x8002_0000)[0].contains("saturated"));
        assert!(Axia.explain(0xc000_0000)[0].contains("out of range"));
        assert_eq!(NetBox.explain(0x8001_0000), [LATCHED]);
        assert_eq!(NetBox.explain(0x8003_0000).len(), 2);
    }

    #[test]
    fn bits_that_nobody_names_are_not_passed_over() {
        for product in [NetBox, Axia, Unknown] {
            for bit in 0..32 {
                assert!(!product.explain(1 << bit).is_empty(), "{product:?}: bit {bit}");
            }
        }
        assert_eq!(NetBox.explain(1 << 15 | 1 << 0), ["an error that the manual does not name"]);
    }

    /// Everything stops but what says nothing of the readings.
    #[test]
    fn saturation_latch_and_unknown_bits_stop_and_field_buses_do_not() {
        for (product, bit, stops) in [
            (NetBox, 17, true),
            (NetBox, 16, true),
            (NetBox, 15, true),
            (NetBox, 2, true),
            (NetBox, 1, false),
            (NetBox, 18, false),
            (NetBox, 19, false),
            (NetBox, 21, false),
            (Axia, 1, true),
            (Axia, 27, true),
            (Axia, 30, true),
            (Axia, 31, true),
            (Unknown, 19, true),
        ] {
            assert_eq!(product.stop_mask() & 1 << bit != 0, stops, "{product:?}: bit {bit}");
        }
        // A Net Box whose only trouble is its field bus sets the summary too, and goes on.
        assert_eq!((1_u32 << 31 | 1 << 18) & NetBox.stop_mask(), 0);
    }
}

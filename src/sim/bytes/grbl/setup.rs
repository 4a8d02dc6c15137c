//! Which machine is emulated: dialect, settings, where it stands when it is switched on.

use std::collections::BTreeMap;
use std::time::Duration;

/// Which firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GrblDialect {
    /// Grbl 1.1h, as on an 8-bit board.
    Classic,
    /// grblHAL.
    Hal,
}

/// Axes of the controller: X, Y, Z. The stage has two of them.
pub(super) const CONTROLLER_AXES: usize = 3;
pub(super) const LETTERS: [char; CONTROLLER_AXES] = ['X', 'Y', 'Z'];

/// A machine with its controller.
#[derive(Debug, Clone, PartialEq)]
pub struct GrblSetup {
    /// Firmware.
    pub dialect: GrblDialect,
    /// Which two axes (0 to 2) carry the tip.
    pub axes: [usize; 2],
    /// Settings by number, as `$$` shows them.
    pub settings: BTreeMap<u16, f64>,
    /// Where the axes stand when it is switched on (mm): 0 where the upper limit switch trips, minus the travel where the lower does.
    pub start_mm: [f64; CONTROLLER_AXES],
    /// Work coordinate offset that somebody has left in it (mm).
    pub work_offset_mm: [f64; CONTROLLER_AXES],
    /// From a line's last byte to its being read. What makes a cancellation overtake a jog.
    pub reading: Duration,
    /// Motion that is prepared ahead in pieces of 10 ms and carried out before braking begins (Grbl: up to 5 pieces, grblHAL 9).
    pub prepared: Duration,
    /// From power or DTR to the banner.
    pub boot: Duration,
    /// Whether opening its port resets it, as DTR does on Arduino-class boards.
    pub resets_on_open: bool,
    /// For the faults that are drawn.
    pub seed: u64,
}

impl GrblSetup {
    /// A small bench: travel of 100 × 60 × 30 mm, 25 mm/s, 200 mm/s², 2.5 µm a step, soft and hard limits on, homing required.
    pub fn bench(dialect: GrblDialect) -> Self {
        let hal = dialect == GrblDialect::Hal;
        let mut settings = BTreeMap::from([
            (0, 10.0),
            // Motors keep their current.
            (1, 255.0),
            (10, if hal { 511.0 } else { 1.0 }),
            (11, 0.01),
            (12, 0.002),
            (13, 0.0),
            (20, 1.0),
            (21, 1.0),
            // grblHAL: homing is enabled by bit 0 and required by bit 2.
            (22, if hal { 5.0 } else { 1.0 }),
            (23, 0.0),
            (24, 100.0),
            (25, 1500.0),
            (26, 25.0),
            (27, 1.0),
        ]);
        for (axis, travel) in [100.0, 60.0, 30.0].into_iter().enumerate() {
            let axis = axis as u16;
            settings.extend([
                (100 + axis, 400.0),
                (110 + axis, 1500.0),
                (120 + axis, 200.0),
                (130 + axis, travel),
            ]);
        }
        Self {
            dialect,
            axes: [0, 2],
            settings,
            start_mm: [-12.0, -5.0, -4.0],
            work_offset_mm: [0.0; CONTROLLER_AXES],
            reading: Duration::from_millis(1),
            prepared: Duration::from_millis(if hal { 90 } else { 50 }),
            boot: Duration::from_millis(100),
            resets_on_open: !hal,
            seed: 1,
        }
    }

    pub(super) fn is_hal(&self) -> bool {
        self.dialect == GrblDialect::Hal
    }

    /// Bytes that the controller keeps for lines it has not read.
    pub(super) fn rx_bytes(&self) -> usize {
        if self.is_hal() { 1024 } else { 128 }
    }

    /// Motions that can be planned ahead.
    pub(super) fn blocks(&self) -> usize {
        if self.is_hal() { 100 } else { 15 }
    }
}

//! What sensor is emulated: product, units, counts, rates, ranges.

/// A family of sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetFtFamily {
    /// Net Box with a transducer.
    NetBox,
    /// Ethernet Axia.
    Axia,
}

/// A unit as the configuration page spells it.
#[derive(Debug, Clone, PartialEq)]
pub struct PageUnit {
    /// Its name.
    pub name: String,
    /// Its code.
    pub code: u8,
    /// What it is worth (N or N·m).
    pub si: f64,
}

impl PageUnit {
    /// A unit of that name and code, worth `si` (N or N·m).
    pub fn new(name: impl Into<String>, code: u8, si: f64) -> Self {
        Self { name: name.into(), code, si }
    }
}

/// The sensor to emulate.
#[derive(Debug, Clone, PartialEq)]
pub struct NetFtSetup {
    /// Its family.
    pub family: NetFtFamily,
    /// Product name on the page; the page has none when it is empty.
    pub product: String,
    /// Serial number of its calibration.
    pub calibration: String,
    /// Name of its configuration.
    pub configuration: String,
    /// Unit of force.
    pub force_unit: PageUnit,
    /// Unit of torque.
    pub torque_unit: PageUnit,
    /// Counts for one unit of force.
    pub counts_per_force: f64,
    /// Counts for one unit of torque.
    pub counts_per_torque: f64,
    /// Records a second that are asked of it. It sends a whole fraction of its internal rate, the next one upwards.
    pub rate_hz: f64,
    /// Internal rate (1/s).
    pub tick_hz: f64,
    /// Records a datagram of the buffered mode.
    pub records_a_datagram: usize,
    /// Largest wrench (N and N·m); beyond, it saturates.
    pub range: [f64; 6],
    /// Force whose magnitude latches the threshold (N).
    pub threshold_n: Option<f64>,
    /// Reading of the internal counter at power-up: 0 in life; near 2³² to see it wrap.
    pub first_tick: u32,
    /// Seed of the faults' randomness.
    pub seed: u64,
}

impl Default for NetFtSetup {
    /// A Net Box with a small transducer (12 N across, 17 N along, 120 N·mm), a million counts a newton and a newton-metre, 7000
    /// records a second.
    fn default() -> Self {
        Self {
            family: NetFtFamily::NetBox,
            product: "Net F/T".to_owned(),
            calibration: "FT00000".to_owned(),
            configuration: "emulated".to_owned(),
            force_unit: PageUnit::new("N", 2, 1.0),
            torque_unit: PageUnit::new("Nm", 3, 1.0),
            counts_per_force: 1e6,
            counts_per_torque: 1e6,
            rate_hz: 7000.0,
            tick_hz: 7000.0,
            records_a_datagram: 10,
            range: [12.0, 12.0, 17.0, 0.12, 0.12, 0.12],
            threshold_n: None,
            first_tick: 0,
            seed: 0,
        }
    }
}

impl NetFtSetup {
    /// Internal ticks from one record to the next.
    pub(super) fn ticks_a_record(&self) -> u64 {
        // A rate that a rounded fraction of the internal rate gives back is that fraction.
        ((self.tick_hz / self.rate_hz + 1e-9).floor() as u64).max(1)
    }
}

//! A fault: its name, its place, its numbers.

/// What was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// Force falls while held.
    Memory,
    /// Force grows faster than the deformation.
    Stiffening,
    /// The first part of the way meets no force.
    Slack,
    /// The sensor shows a force where there is none.
    SensorZero,
    /// That force is another one after the test.
    ZeroMoved,
    /// The specimen holds on to the plate on the way back.
    Sticking,
    /// Force is lost at once, and does not come back.
    Slipped,
    /// The sensor shows the same while the deformation goes on.
    Saturated,
    /// Force rises while held: the sensor's drift or the temperature.
    Rise,
    /// The crosshead does not stand still while it should.
    NotHeld,
    /// Single samples far off.
    Spikes,
    /// Something is left that has no name.
    Unexplained,
}

impl Name {
    /// Its name.
    pub fn words(self) -> &'static str {
        match self {
            Self::Memory => "memory",
            Self::Stiffening => "stiffening",
            Self::Slack => "slack",
            Self::SensorZero => "sensor zero",
            Self::ZeroMoved => "sensor zero moved during the test",
            Self::Sticking => "sticking on unloading",
            Self::Slipped => "slipped",
            Self::Saturated => "sensor saturated",
            Self::Rise => "force rises in the hold (drift or temperature)",
            Self::NotHeld => "not held still",
            Self::Spikes => "spikes",
            Self::Unexplained => "unexplained",
        }
    }

    /// Whether it belongs to the material, not to the test.
    pub fn is_material(self) -> bool {
        matches!(self, Self::Memory | Self::Stiffening)
    }
}

/// One thing that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What.
    pub name: Name,
    /// Lines of the file, first and last.
    pub lines: [u64; 2],
    /// What shows it, with numbers.
    pub shown: String,
    /// Root mean square missed in unseen data over the peak, without and with it in the model; none where it is not modelled.
    pub held_out: Option<[f64; 2]>,
}

//! A fault: its name, what else would look the same, its place, its numbers.

/// What was left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Name {
    /// Force falls while held, or is less on the way back.
    Memory,
    /// Force grows faster than the deformation.
    Stiffening,
    /// Force grows slower than the deformation.
    Flattening,
    /// Force is less from cycle to cycle.
    Softening,
    /// From cycle to cycle the force begins later.
    Lengthened,
    /// The first part of the way meets no force.
    Slack,
    /// The sensor shows a force where there is none.
    SensorZero,
    /// That force is another one after the test.
    ZeroMoved,
    /// The specimen was already loaded where the file begins.
    LoadedBefore,
    /// The same force against the way, whichever way that is.
    Friction,
    /// The drive loses way where it turns.
    Play,
    /// The force is written down later than the deformation.
    Lag,
    /// The force is written down earlier than the deformation.
    Lead,
    /// Grips, shoulders and machine give way.
    Compliance,
    /// The gauge length is another one than the file says.
    GaugeLength,
    /// Numbers that are another unit's.
    WrongUnit,
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
    /// Samples that stand off, alone or a few in a row.
    Spikes,
    /// Something is left that can't be told.
    Unexplained,
}

impl Name {
    /// Its name.
    pub fn words(self) -> &'static str {
        match self {
            Self::Memory => "memory",
            Self::Stiffening => "stiffening",
            Self::Flattening => "flattening",
            Self::Softening => "softening with cycles",
            Self::Lengthened => "longer with cycles (set, or slip in the grips)",
            Self::Slack => "slack",
            Self::SensorZero => "sensor zero",
            Self::ZeroMoved => "sensor zero moved during the test",
            Self::LoadedBefore => "loaded before the test began",
            Self::Friction => "friction of the machine",
            Self::Play => "play in the drive",
            Self::Lag => "force recorded later than the way",
            Self::Lead => "force recorded earlier than the way",
            Self::Compliance => "machine compliance",
            Self::GaugeLength => "gauge length other than stated",
            Self::WrongUnit => "wrong unit",
            Self::Sticking => "sticking on unloading",
            Self::Slipped => "slipped",
            Self::Saturated => "sensor saturated",
            Self::Rise => "force rises in the hold (drift or temperature)",
            Self::NotHeld => "not held still",
            Self::Spikes => "spikes",
            Self::Unexplained => "can't be told",
        }
    }

    /// Whether it belongs to the material, not to the test.
    pub fn is_material(self) -> bool {
        matches!(self, Self::Memory | Self::Stiffening | Self::Flattening | Self::Softening)
    }
}

/// One thing that was left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// What, or the likeliest of what it may be.
    pub name: Name,
    /// What the data cannot tell from it.
    pub or: Vec<Name>,
    /// Lines of the file, first and last.
    pub lines: [u64; 2],
    /// What shows it, with numbers.
    pub shown: String,
    /// Root mean square missed in rows that no fit saw, over the peak, without and with it in the model; none where nothing explains it.
    pub held_out: Option<[f64; 2]>,
}

impl Fault {
    /// Its name with those that the data cannot tell from it.
    pub fn words(&self) -> String {
        let others: Vec<&str> = self.or.iter().map(|n| n.words()).collect();
        if others.is_empty() {
            return self.name.words().to_owned();
        }
        format!("{}, or {} (not told apart)", self.name.words(), others.join(", or "))
    }

    /// Whether it belongs to the material, whichever of its names is right.
    pub fn is_material(&self) -> bool {
        self.name.is_material() && self.or.iter().all(|n| n.is_material())
    }
}

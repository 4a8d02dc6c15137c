//! What a baseline fit may leave out: the entries of the physics catalogue, and what is looked for beside them.

use std::fmt;

macro_rules! catalogue {
    ($($(#[$doc:meta])* $name:ident = $id:literal,)*) => {
        /// One entry of the physics catalogue, or what is none and looked for all the same.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Physics {
            $($(#[$doc])* $name,)*
            /// The camera's scale differs over the picture, as that of a lens or a slant which calibration missed: no entry of the
            /// catalogue. What is explained best with it is `unexplained`.
            UnevenScale,
            /// Dry friction drags beside the restraint's springs: no entry either.
            StickyRestraint,
        }

        impl Physics {
            /// All entries, in the catalogue's order.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// Id of the catalogue, or one of its own for what is not listed there.
            pub fn id(self) -> &'static str {
                match self {
                    $(Self::$name => $id,)*
                    Self::UnevenScale => "uneven-scale",
                    Self::StickyRestraint => "sticky-restraint",
                }
            }

            /// The entry of an id.
            pub fn of_id(id: &str) -> Option<Self> {
                match id { $($id => Some(Self::$name),)* _ => None }
            }
        }
    };
}

catalogue! {
    /// Large rotations and strains.
    FiniteStrain = "finite-strain",
    /// The modulus rises with strain.
    StrainStiffening = "strain-stiffening",
    /// Memory of the phantom (Prony series).
    ViscoelasticRelaxation = "viscoelastic-relaxation",
    /// Softer after the deepest load.
    StressSoftening = "stress-softening",
    /// The modulus drifts over the session.
    Drying = "drying",
    /// A ball of another modulus.
    Inclusion = "inclusion",
    /// Stiffer along one axis.
    Anisotropy = "anisotropy",
    /// The stated Poisson's ratio is wrong.
    PoissonRatio = "poisson-ratio",
    /// Part of the known glue has let go.
    BaseDebonding = "base-debonding",
    /// The known hold gives.
    CompliantBase = "compliant-base",
    /// A restraint that acts beyond a gap, in tension only.
    SlackBand = "slack-band",
    /// A restraint with memory.
    BandViscosity = "band-viscosity",
    /// The tip slides.
    TipSlip = "tip-slip",
    /// The tip touches later than the log says.
    LateContact = "late-contact",
    /// Lost motion of the stage at reversal.
    StageBacklash = "stage-backlash",
    /// Frame or tip holder gives.
    StageCompliance = "stage-compliance",
    /// The zero of the force sensor wanders.
    ForceDrift = "force-drift",
    /// Sensitivities of the force sensor's axes differ from what is stated.
    ForceGain = "force-gain",
    /// The camera's frame is turned against the phantom's.
    CameraMisalignment = "camera-misalignment",
    /// Scale or depth gain of the camera.
    CameraScale = "camera-scale",
    /// The camera's clock is late.
    CameraLag = "camera-lag",
    /// The phantom's weight, and the strain that it leaves.
    SelfWeight = "self-weight",
    /// Elements too coarse for what they are to resolve.
    CoarseMesh = "coarse-mesh",
}

impl Physics {
    /// Whether it is an entry of the catalogue.
    pub fn catalogued(self) -> bool {
        !matches!(self, Self::UnevenScale | Self::StickyRestraint)
    }

    /// What it is called in a remark.
    pub(super) fn said(self) -> &'static str {
        match self {
            Self::UnevenScale => "a camera's scale that differs over the picture",
            Self::StickyRestraint => "dry friction beside the restraint",
            listed => listed.id(),
        }
    }

    /// The entry that stands for those that are much alike: stiffening contains large strain.
    pub(super) fn family(self) -> Self {
        if self == Self::StrainStiffening { Self::FiniteStrain } else { self }
    }
}

impl fmt::Display for Physics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

//! What the tracker has to be told about the dots.

use super::TrackError;

/// What a dot looks like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotSettings {
    /// Smallest and largest radius of a dot in the picture (px); the larger one where a tilted dot is longer.
    pub radius_px: [f64; 2],
    /// Longest over shortest diameter that a tilted dot may have: 2 is a tilt of 60°.
    pub most_aspect: f64,
    /// Least height of a dot above its surroundings, in standard deviations of the noise.
    pub least_contrast: f64,
}

impl Default for DotSettings {
    fn default() -> Self {
        Self { radius_px: [2.5, 12.0], most_aspect: 2.2, least_contrast: 8.0 }
    }
}

impl DotSettings {
    /// Refuses what no dot can be.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn check(&self) -> Result<(), TrackError> {
        let [least, most] = self.radius_px;
        let wrong = |name, value, expected| Err(TrackError::Setting { name, value, expected });
        if !(1.5..=100.0).contains(&least) {
            return wrong("the smallest radius_px", least, "1.5 to 100 px");
        }
        if !(most >= least && most <= 200.0) {
            return wrong("the largest radius_px", most, "at least the smallest one and at most 200 px");
        }
        if !(1.0..=10.0).contains(&self.most_aspect) {
            return wrong("most_aspect", self.most_aspect, "1 to 10");
        }
        if !(3.0..=1000.0).contains(&self.least_contrast) {
            return wrong("least_contrast", self.least_contrast, "3 to 1000");
        }
        Ok(())
    }
}

/// Where the depth around a dot is read, and what is believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthSettings {
    /// Inner and outer edge of the ring, in radii of the dot.
    pub ring: [f64; 2],
    /// Least share of the ring's pixels that must have a depth.
    pub least_valid: f64,
    /// Least share of those that must lie on one plane.
    pub least_agreeing: f64,
    /// Largest robust standard deviation of depths about their plane (m).
    pub most_rough_m: f64,
}

impl Default for DepthSettings {
    fn default() -> Self {
        Self { ring: [1.3, 2.4], least_valid: 0.4, least_agreeing: 0.65, most_rough_m: 0.002 }
    }
}

impl DepthSettings {
    /// Refuses what no ring can be.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn check(&self) -> Result<(), TrackError> {
        let [inner, outer] = self.ring;
        let wrong = |name, value, expected| Err(TrackError::Setting { name, value, expected });
        if !(1.0..=5.0).contains(&inner) {
            return wrong("the inner edge of ring", inner, "1 to 5 radii");
        }
        if !(outer > inner && outer <= 10.0) {
            return wrong("the outer edge of ring", outer, "more than the inner one and at most 10 radii");
        }
        for (name, share) in [("least_valid", self.least_valid), ("least_agreeing", self.least_agreeing)] {
            if !(0.0..=1.0).contains(&share) {
                return wrong(name, share, "0 to 1");
            }
        }
        if !(self.most_rough_m.is_finite() && self.most_rough_m > 0.0) {
            return wrong("most_rough_m", self.most_rough_m, "a positive number");
        }
        Ok(())
    }
}

/// How far dots move, and when an identity is certain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IdentitySettings {
    /// How far a dot may move from one frame to the next, in spacings of the dots around it. Nothing is ever identified that would be
    /// wrong only if dots moved faster.
    pub most_motion: f64,
    /// How far a dot may lie from where its neighbours say, in spacings.
    pub gate: f64,
    /// By how many nats an explanation of a motion of all dots must beat the next best before it is believed.
    pub least_evidence: f64,
}

impl Default for IdentitySettings {
    fn default() -> Self {
        Self { most_motion: 0.65, gate: 0.22, least_evidence: 20.0 }
    }
}

impl IdentitySettings {
    /// Refuses what would make guesses of identities.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn check(&self) -> Result<(), TrackError> {
        let wrong = |name, value, expected| Err(TrackError::Setting { name, value, expected });
        if !(0.05..=0.9).contains(&self.most_motion) {
            return wrong("most_motion", self.most_motion, "0.05 to 0.9 spacings");
        }
        if !(0.02..=0.35).contains(&self.gate) {
            return wrong("gate", self.gate, "0.02 to 0.35 spacings");
        }
        if !(3.0..=1000.0).contains(&self.least_evidence) {
            return wrong("least_evidence", self.least_evidence, "3 to 1000 nats");
        }
        Ok(())
    }
}

/// Everything that the tracker has to be told.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// What a dot looks like.
    pub dots: DotSettings,
    /// Where depth is read.
    pub depth: DepthSettings,
    /// How far dots move.
    pub identity: IdentitySettings,
}

impl Settings {
    /// Refuses settings that make no sense.
    ///
    /// # Errors
    /// [`TrackError::Setting`].
    pub fn check(&self) -> Result<(), TrackError> {
        self.dots.check()?;
        self.depth.check()?;
        self.identity.check()
    }
}

//! Entries that one recording may not tell apart, as the end of the physics catalogue declares them.

/// Sets of entries; a verdict that reports a set of these which holds the answer is right.
///
/// The catalogue's line, in order: stiffening contains finite strain; a debonded disc looks like a soft inclusion at the
/// base; drying, softening in the first cycle and slow relaxation without a repeated poke; the stage's give and a softer
/// phantom if markers are few; lag and fast relaxation if all rates are equal. A gain common to all axes, the modulus and
/// the restraint's scale are not entries of their own, and neither is a softer phantom: the baseline absorbs them.
const DECLARED: [&[&str]; 4] = [
    &["finite-strain", "strain-stiffening"],
    &["base-debonding", "inclusion"],
    &["drying", "stress-softening", "viscoelastic-relaxation"],
    &["camera-lag", "viscoelastic-relaxation"],
];

/// Whether the catalogue declares that one recording may not tell the two apart.
pub(super) fn declared(one: &str, other: &str) -> bool {
    one != other && DECLARED.iter().any(|set| set.contains(&one) && set.contains(&other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Physics;

    #[test]
    fn aliases_are_entries_and_mutual() {
        for id in DECLARED.concat() {
            assert!(Physics::of_id(id).is_some(), "{id} is not in the catalogue");
            assert!(!declared(id, id));
        }
        assert!(declared("inclusion", "base-debonding") && declared("base-debonding", "inclusion"));
        assert!(!declared("camera-lag", "drying"), "sets are not chained");
    }
}

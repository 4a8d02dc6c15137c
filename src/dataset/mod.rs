//! Recording bundles turned into observations, and back.

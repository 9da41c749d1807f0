//! Beams by their entries, for tests of the map and of the sums.

use vpm_core::Scalar;
use vpm_core::beam::{BeamEntry, Component, DampingEntry, Level, Material, SectionEntry, Shape};
use vpm_core::mount::Mount;

/// Steel.
pub const STEEL: Material = Material { young: 210e9, poisson: 0.3, density: 7850.0 };
/// The six components in the order of the screw.
pub const ALL: [Component; 6] = Component::ALL;

/// A beam of one rectangle.
pub fn entry(level: Level, deforms: &[Component], length: f64, [width, height]: [f64; 2]) -> BeamEntry<f64> {
    BeamEntry {
        name: "arm".to_owned(),
        on: Mount::World,
        translation: [0.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        length,
        level,
        deforms: deforms.to_vec(),
        material: Some(STEEL),
        sections: vec![SectionEntry::new(0.0, Shape::Rectangle { width, height })],
        rest: Vec::new(),
        damping: DampingEntry::default(),
        reduced: None,
    }
}

/// Beams of these levels in several mixes of components, up to all that there are.
pub fn mixes(levels: &[Level]) -> Vec<BeamEntry<f64>> {
    use Component::{BendingX, BendingY, Extension, Torsion};
    let deforms = [&[BendingX][..], &[BendingY], &[BendingX, BendingY, Torsion], &[Torsion, Extension], &ALL];
    let all = levels.iter().flat_map(|&level| deforms.iter().map(move |&deforms| (level, deforms)));
    all.map(|(level, deforms)| entry(level, deforms, 0.8, [0.02, 0.01])).collect()
}

/// The same beam over another number type, without derivatives.
pub fn lift<S: Scalar>(entry: &BeamEntry<f64>) -> BeamEntry<S> {
    entry.map(&mut |&value| S::from_f64(value))
}

/// The material of a beam of the tests, all of which have one.
pub fn material<P: Copy>(beam: &BeamEntry<P>) -> Material<P> {
    let Some(material) = beam.material else { unreachable!("a beam of the tests has a material") };
    material
}

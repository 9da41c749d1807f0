//! The order in which the parts of a tree hang on each other.

use crate::error::{Error, Result};
use crate::mount::Mount;

/// A part that others can hang on, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Body(usize),
    Beam(usize),
}

/// What bodies and beams sit on, with their names.
pub(super) struct Hanging<'a> {
    pub(super) bodies: Vec<(&'a str, Mount)>,
    pub(super) beams: Vec<(&'a str, Mount)>,
}

impl Hanging<'_> {
    /// All bodies and beams, each after what it hangs on; bodies in their own order where that is one.
    pub(super) fn sorted(&self) -> Result<Vec<Part>> {
        let all = (0..self.bodies.len()).map(Part::Body).chain((0..self.beams.len()).map(Part::Beam));
        let (mut waiting, mut order) = (all.collect::<Vec<_>>(), Vec::new());
        while !waiting.is_empty() {
            let before = order.len();
            waiting.retain(|&part| {
                let ready = self.below(part).is_none_or(|carrier| order.contains(&carrier));
                if ready {
                    order.push(part);
                }
                !ready
            });
            if order.len() == before {
                return Err(self.ring(waiting[0], waiting.len()));
            }
        }
        Ok(order)
    }

    /// Part below in the order: what a part hangs on, if it is not the world.
    fn below(&self, part: Part) -> Option<Part> {
        let (_, mount) = self.entry(part);
        match mount {
            Mount::World => None,
            Mount::Body(body) => Some(Part::Body(body)),
            Mount::Section { beam, .. } => Some(Part::Beam(beam)),
        }
    }

    fn entry(&self, part: Part) -> (&str, Mount) {
        match part {
            Part::Body(k) => self.bodies[k],
            Part::Beam(k) => self.beams[k],
        }
    }

    /// Ring that makes an order impossible, reached from a part by going down.
    fn ring(&self, from: Part, steps: usize) -> Error {
        let down = |part: Part| self.below(part).unwrap_or(part);
        let start = (0..steps).fold(from, |part, _| down(part));
        let mut ring = vec![start];
        while down(ring[ring.len() - 1]) != start {
            ring.push(down(ring[ring.len() - 1]));
        }
        // Begins with the body that comes first, so that the message does not depend on the way in.
        let first = (0..ring.len()).min_by_key(|&k| match ring[k] {
            Part::Body(number) => (0, number),
            Part::Beam(number) => (1, number),
        });
        ring.rotate_left(first.unwrap_or(0));
        Error::Loop { names: ring.into_iter().map(|part| self.entry(part).0.to_owned()).collect() }
    }
}

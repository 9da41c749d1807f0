//! Where everything of a tree is and what it weighs, from the parts alone, without the order and the frames that the model makes of them.

use vpm_core::beam::Beam;
use vpm_core::body::Site;
use vpm_core::model::Parts;
use vpm_core::mount::Mount;
use vpm_core::spatial::{Matrix3, Pose, SpatialInertia, Vector3};
use vpm_core::{Result, Scalar};

use super::trees::lift;

/// Arc lengths on a beam where something sits: the same as in the model, as beams of exact geometry are integrated from one to the next.
fn marks(parts: &Parts<f64>, beam: usize) -> Vec<f64> {
    let bodies = parts.bodies.iter().map(|body| body.on);
    let parents = bodies.chain(parts.welds.iter().map(|weld| weld.on)).chain(parts.beams.iter().map(|other| other.on));
    let ends = parts.lines.iter().flat_map(|line| [line.from.on, line.to.on]);
    let all = parents.chain(ends).chain(parts.markers.iter().map(|marker| marker.on));
    let tips = parts.point_masses.iter().filter(|point| point.on == Site::Tip(beam)).map(|_| parts.beams[beam].length);
    let own = |mount| match mount {
        Mount::Section { beam: other, at } if other == beam => Some(at),
        _ => None,
    };
    all.filter_map(own).chain(tips).collect()
}

/// Whatever has mass: an inertia in a frame, or a needle at a point with a direction.
pub enum Heavy<S> {
    /// A body in a frame.
    Body(Pose<S>, SpatialInertia<f64>),
    /// A needle.
    Needle { center: Vector3<S>, direction: Vector3<S>, mass: f64, inertia: f64 },
}

/// Frames of the machine in the world, from the parts alone: the recursion over mounts as they are written.
pub struct Places<'a, S> {
    parts: &'a Parts<f64>,
    lifted: Parts<S>,
    beams: Vec<Placed<S>>,
}

/// A beam, the arc lengths of its marks and its first coordinate.
struct Placed<S> {
    beam: Beam<S>,
    marks: Vec<f64>,
    first: usize,
}

impl<'a, S: Scalar> Places<'a, S> {
    /// The machine of these parts.
    pub fn new(parts: &'a Parts<f64>) -> Result<Self> {
        let (lifted, mut first) = (lift::<S>(parts), parts.bodies.len());
        let mut beams = Vec::new();
        for entry in &lifted.beams {
            let marks = marks(parts, beams.len());
            let beam = Beam::new(entry, &marks)?;
            let own = first;
            first += beam.len();
            beams.push(Placed { beam, marks, first: own });
        }
        Ok(Self { parts, lifted, beams })
    }

    fn mount(&self, q: &[S], mount: Mount) -> Pose<S> {
        match mount {
            Mount::World => Pose::identity(),
            Mount::Body(k) => {
                let body = &self.parts.bodies[k];
                self.mount(q, body.on) * body.joint.pose(q[k])
            }
            Mount::Section { beam, at } => {
                let Placed { beam: own, marks, .. } = &self.beams[beam];
                let mark = marks.iter().position(|&mark| mark == at).unwrap_or(0);
                self.stations(q, beam)[own.mark(mark)]
            }
        }
    }

    fn placed(&self, q: &[S], on: Mount, translation: [f64; 3], rotation: [f64; 9]) -> Pose<S> {
        self.mount(q, on) * Pose::new(Matrix3::from_rows_f64(rotation), Vector3::from_f64(translation))
    }

    fn stations(&self, q: &[S], number: usize) -> Vec<Pose<S>> {
        let (entry, Placed { beam, first, .. }) = (&self.parts.beams[number], &self.beams[number]);
        let root = self.placed(q, entry.on, entry.translation, entry.rotation);
        let (mut sections, rest) = (beam.sections(), vec![S::zero(); beam.len()]);
        beam.motion(&q[*first..first + beam.len()], &rest, &mut sections);
        sections.at.iter().map(|section| root * section.pose).collect()
    }

    /// Whatever has mass, at coordinates `q`.
    pub fn heavy(&self, q: &[S]) -> Vec<Heavy<S>> {
        let mut all = Vec::new();
        for (k, body) in self.parts.bodies.iter().enumerate() {
            if let Some(inertia) = body.inertia {
                all.push(Heavy::Body(self.mount(q, Mount::Body(k)), inertia.spatial()));
            }
        }
        for weld in &self.parts.welds {
            all.push(Heavy::Body(self.placed(q, weld.on, weld.translation, weld.rotation), weld.inertia.spatial()));
        }
        for (number, Placed { beam, .. }) in self.beams.iter().enumerate() {
            for (station, pose) in self.stations(q, number).into_iter().enumerate() {
                all.push(Heavy::Body(pose, beam.inertia(station).value()));
            }
        }
        for point in &self.parts.point_masses {
            let place = match point.on {
                Site::Body(k) => self.mount(q, Mount::Body(k)),
                Site::Weld(k) => {
                    let weld = &self.parts.welds[k];
                    self.placed(q, weld.on, weld.translation, weld.rotation)
                }
                Site::Tip(beam) => self.mount(q, Mount::Section { beam, at: self.parts.beams[beam].length }),
            };
            all.push(Heavy::Body(place, SpatialInertia::point_mass(point.mass, Vector3::from(point.position))));
        }
        for line in &self.parts.lines {
            let [from, to] = [line.from, line.to].map(|end| self.mount(q, end.on).point(Vector3::from_f64(end.point)));
            let across = to - from;
            let direction = across * across.dot(across).sqrt().recip();
            let at = |point: Vector3<S>, center: f64| point + direction * S::from_f64(center);
            let barrel = line.barrel.map(|part| (at(from, part.center), part));
            for (center, part) in barrel.into_iter().chain(line.rod.map(|part| (at(to, -part.center), part))) {
                all.push(Heavy::Needle { center, direction, mass: part.mass, inertia: part.inertia });
            }
        }
        assert_eq!(self.lifted.bodies.len(), self.parts.bodies.len());
        all
    }
}

//! From the parts of a machine to its tree.

use super::order::{Hanging, Part};
use super::{Elastic, Model, Omissions, Place};
use crate::beam::{Beam, BeamEntry, Level};
use crate::body::{Body, PointMass, Site, Weld, check_physical};
use crate::error::{Error, Result};
use crate::joint::Joint;
use crate::line::Line;
use crate::mount::{Gauge, Marker, Mount, placed};
use crate::scalar::Scalar;
use crate::spatial::{Pose, SpatialInertia, Vector3};
use crate::transmission::Transmission;

/// Everything that makes up a tree, over the number type `S`.
#[derive(Clone, Debug, Default)]
pub struct Parts<S> {
    /// Gravity in the world frame, m/s^2.
    pub gravity: [S; 3],
    /// Bodies with their joints.
    pub bodies: Vec<Body<S>>,
    /// Bodies without joints.
    pub welds: Vec<Weld<S>>,
    /// Beams.
    pub beams: Vec<BeamEntry<S>>,
    /// Payloads. One may be negative (a correction to a mass taken too large) as long as what its body then has is physical.
    pub point_masses: Vec<PointMass<S>>,
    /// Lines.
    pub lines: Vec<Line<S>>,
    /// Transmissions.
    pub transmissions: Vec<Transmission<S>>,
    /// Markers.
    pub markers: Vec<Marker>,
    /// Frames of inertial measurement units.
    pub imus: Vec<Marker>,
    /// Strain gauges.
    pub gauges: Vec<Gauge>,
    /// Frames that contacts and bushings act on.
    pub attachments: Vec<Marker>,
    /// Whether loops close on some of these, which takes the mass matrix.
    pub closed: bool,
    /// Whether products of rates are left out of the dynamics.
    pub drop_velocity_terms: bool,
    /// What else is left out, part by part.
    pub omissions: Omissions,
}

/// A tree on its way.
pub(super) struct Assembly<'a, S> {
    pub(super) parts: &'a Parts<S>,
    pub(super) joints: Vec<Joint>,
    /// Arc lengths of the marks of each beam.
    marks: Vec<Vec<f64>>,
    pub(super) beams: Vec<Elastic<S>>,
    /// Inertia on each frame; that of a body in its own frame.
    pub(super) inertias: Vec<SpatialInertia<S>>,
    /// Whether anything with inertia is fixed to each frame, of whatever size.
    pub(super) heavy: Vec<bool>,
}

impl<S: Scalar> Model<S> {
    /// Assembles the tree, or says what cannot be.
    ///
    /// Checked: all references, one way from everything to the world, geometry, physical inertias, sections within their beams.
    pub fn assemble(parts: Parts<S>) -> Result<Self> {
        check_gravity(parts.gravity)?;
        parts.check_references()?;
        let order = parts.hanging().sorted()?;
        let mut assembly = Assembly::new(&parts)?;
        assembly.place_beams(&order)?;
        assembly.gather()?;
        assembly.check_bodies()?;
        assembly.model(&order)
    }
}

impl<S: Scalar> Parts<S> {
    fn hanging(&self) -> Hanging<'_> {
        Hanging {
            bodies: self.bodies.iter().map(|body| (body.name.as_str(), body.on)).collect(),
            beams: self.beams.iter().map(|beam| (beam.name.as_str(), beam.on)).collect(),
        }
    }

    /// Mounts of the parts to assemble, with the words that name each in a message.
    fn mounts(&self) -> impl Iterator<Item = (String, Mount)> {
        let bodies = self.bodies.iter().map(|body| (format!("joint `{}`", body.joint.name), body.on));
        let welds = self.welds.iter().map(|weld| (format!("body `{}`", weld.name), weld.on));
        let beams = self.beams.iter().map(|beam| (format!("beam `{}`", beam.name), beam.on));
        let markers = self.markers.iter().map(|marker| (format!("marker `{}`", marker.name), marker.on));
        let imus = self.imus.iter().map(|imu| (format!("inertial measurement unit `{}`", imu.name), imu.on));
        let gauge =
            |gauge: &Gauge| (format!("gauge `{}`", gauge.name), Mount::Section { beam: gauge.beam, at: gauge.at });
        let ends = self.lines.iter().flat_map(|line| {
            [("from", line.from.on), ("to", line.to.on)].map(|(end, on)| (format!("`{}.{end}`", line.name), on))
        });
        let attachments = self.attachments.iter().map(|frame| (format!("`{}`", frame.name), frame.on));
        bodies
            .chain(welds)
            .chain(beams)
            .chain(markers)
            .chain(imus)
            .chain(self.gauges.iter().map(gauge))
            .chain(ends)
            .chain(attachments)
    }

    fn check_references(&self) -> Result<()> {
        for (what, mount) in self.mounts() {
            let (target, index, count) = match mount {
                Mount::World => continue,
                Mount::Body(body) => ("body", body, self.bodies.len()),
                Mount::Section { beam, .. } => ("beam", beam, self.beams.len()),
            };
            if index >= count {
                return Err(Error::Reference { what, target, index, count });
            }
            let Mount::Section { beam, at } = mount else { continue };
            let BeamEntry { name, length, .. } = &self.beams[beam];
            if at.is_nan() || at < 0.0 || at > *length {
                return Err(Error::Section { what, beam: name.clone(), at, length: *length });
            }
        }
        for (index, target, count) in self.omitting() {
            if index >= count {
                return Err(Error::Reference { what: "what is left out".to_owned(), target, index, count });
            }
        }
        for (payload, point) in self.point_masses.iter().enumerate() {
            let (body, bodies) = match point.on {
                Site::Body(body) => (body, self.bodies.len()),
                Site::Weld(weld) => (weld, self.welds.len()),
                Site::Tip(beam) => (beam, self.beams.len()),
            };
            if body >= bodies {
                return Err(Error::PayloadBody { payload, body, bodies });
            }
            check_point_mass(self.site_name(point.on), point)?;
        }
        Ok(())
    }

    /// Numbers of assembled parts of which something is left out, what they are and how many there are.
    fn omitting(&self) -> impl Iterator<Item = (usize, &'static str, usize)> {
        let Omissions { velocity_of_bodies, velocity_of_beams, coupling, second_order } = &self.omissions;
        let (bodies, beams) = (self.bodies.len(), self.beams.len());
        let of_bodies = velocity_of_bodies.iter().map(move |&body| (body, "body", bodies));
        let of_joints = coupling.iter().map(move |&joint| (joint, "joint", bodies));
        let of_beams = velocity_of_beams.iter().chain(second_order).map(move |&beam| (beam, "beam", beams));
        of_bodies.chain(of_joints).chain(of_beams)
    }

    fn site_name(&self, site: Site) -> &str {
        match site {
            Site::Body(body) => &self.bodies[body].name,
            Site::Weld(weld) => &self.welds[weld].name,
            Site::Tip(beam) => &self.beams[beam].name,
        }
    }

    /// Marks on a beam in the assembly where something sits, without repetition.
    fn marks(&self, number: usize) -> Vec<f64> {
        let mut marks = Vec::new();
        let tips = self.point_masses.iter().filter(|point| point.on == Site::Tip(number));
        let sections = self.mounts().filter_map(|(_, mount)| match mount {
            Mount::Section { beam, at } if beam == number => Some(at),
            _ => None,
        });
        for at in sections.chain(tips.map(|_| self.beams[number].length)) {
            if !marks.contains(&at) {
                marks.push(at);
            }
        }
        marks
    }
}

impl<'a, S: Scalar> Assembly<'a, S> {
    /// Assembly with its beams, not yet in their places.
    fn new(parts: &'a Parts<S>) -> Result<Self> {
        let joints = parts.bodies.iter().map(|body| body.joint.checked()).collect::<Result<_>>()?;
        let marks: Vec<_> = (0..parts.beams.len()).map(|beam| parts.marks(beam)).collect();
        let (mut coordinate, mut frame) = (parts.bodies.len(), parts.bodies.len() + 1);
        let mut beams = Vec::new();
        for (number, (entry, marks)) in parts.beams.iter().zip(&marks).enumerate() {
            let beam = match parts.omissions.second_order.contains(&number) {
                true => Beam::first_order(entry, marks)?,
                false => Beam::new(entry, marks)?,
            };
            let (first, rigid) = (coordinate, entry.level == Level::Rigid);
            let of_first_station = (!rigid).then_some(frame);
            (coordinate, frame) = (coordinate + beam.len(), frame + if rigid { 0 } else { beam.stations() });
            let root = Place::world();
            beams.push(Elastic {
                beam,
                root,
                coordinate: first,
                frame: of_first_station,
                inertias: Vec::new(),
                heavy: Vec::new(),
                slices: None,
                segment_slices: Vec::new(),
            });
        }
        let (inertias, heavy) = (vec![SpatialInertia::zero(); frame], vec![false; frame]);
        Ok(Self { parts, joints, marks, beams, inertias, heavy })
    }

    fn place_beams(&mut self, order: &[Part]) -> Result<()> {
        for part in order {
            if let Part::Beam(number) = *part {
                let entry = &self.parts.beams[number];
                let root = placed(&entry.name, entry.translation, entry.rotation)?;
                self.beams[number].root = self.resolved(entry.on).beyond(root);
            }
        }
        Ok(())
    }

    /// Place of a mount in the assembly; on a body, in the body's own frame.
    pub(super) fn resolved(&self, mount: Mount) -> Place {
        let (frame, pose) = match mount {
            Mount::World => (0, Pose::identity()),
            Mount::Body(body) => (body + 1, Pose::identity()),
            Mount::Section { beam, at } => {
                let elastic = &self.beams[beam];
                let mark = self.marks[beam].iter().position(|&mark| mark == at).unwrap_or(0);
                let Some(first) = elastic.frame else {
                    return elastic.root.beyond(elastic.beam.at_rest(mark, at));
                };
                (first + elastic.beam.mark(mark), Pose::identity())
            }
        };
        Place { frame, pose }
    }

    /// Place of a mount in the assembly; on a body, in the body's aligned frame.
    pub(super) fn aligned(&self, place: Place) -> Place {
        let pose = self.alignment(place.frame).inverse() * place.pose;
        Place { frame: place.frame, pose }
    }

    /// Aligned frame of an assembled body in its own; of any other frame, itself.
    pub(super) fn alignment(&self, frame: usize) -> Pose<f64> {
        let joint = frame.checked_sub(1).and_then(|body| self.joints.get(body));
        joint.map_or(Pose::identity(), |joint| Pose::new(joint.alignment(), Vector3::zero()))
    }

    /// Assembles all inertias in the frames that move them.
    fn gather(&mut self) -> Result<()> {
        for (body, inertia) in self.parts.bodies.iter().zip(self.inertias.iter_mut().skip(1)) {
            *inertia = body.spatial_inertia()?;
        }
        for number in 0..self.beams.len() {
            self.gather_beam(number);
        }
        for weld in &self.parts.welds {
            let place = self.resolved(weld.on).beyond(placed(&weld.name, weld.translation, weld.rotation)?);
            self.add(place, weld.inertia.checked(&weld.name)?);
        }
        for point in &self.parts.point_masses {
            let place = self.site(point.on)?;
            self.add(place, SpatialInertia::point_mass(point.mass, Vector3::from(point.position)));
        }
        Ok(())
    }

    /// Frame in the assembly on which a point mass sits.
    fn site(&self, site: Site) -> Result<Place> {
        Ok(match site {
            Site::Body(body) => self.resolved(Mount::Body(body)),
            Site::Weld(number) => {
                let weld = &self.parts.welds[number];
                self.resolved(weld.on).beyond(placed(&weld.name, weld.translation, weld.rotation)?)
            }
            Site::Tip(beam) => self.resolved(Mount::Section { beam, at: self.parts.beams[beam].length }),
        })
    }

    fn gather_beam(&mut self, number: usize) {
        let Elastic { beam, root, frame, .. } = &self.beams[number];
        if let Some(first) = *frame {
            for station in 0..beam.stations() {
                self.inertias[first + station] += beam.inertia(station);
                self.heavy[first + station] |= beam.is_heavy(station);
            }
            return;
        }
        let mut sections = beam.sections();
        beam.motion(&[], &[], &mut sections);
        let root_pose = Pose::from_f64(root.pose);
        for (station, section) in sections.at.iter().enumerate() {
            self.inertias[root.frame] += (root_pose * section.pose).inertia(beam.inertia(station));
        }
    }

    fn add(&mut self, place: Place, inertia: SpatialInertia<S>) {
        self.inertias[place.frame] += Pose::from_f64(place.pose).inertia(inertia);
        self.heavy[place.frame] = true;
    }

    /// Checks that assembled bodies are physical with all that is fixed to them, and nothing hangs in the air.
    fn check_bodies(&self) -> Result<()> {
        for point in &self.parts.point_masses {
            let (name, frame) = (self.parts.site_name(point.on), self.site(point.on)?.frame);
            let total = self.inertias[frame].value();
            // A beam carries its own mass: without anything at its tip there is nothing to check.
            if matches!(point.on, Site::Tip(_)) && total.mass == 0.0 {
                continue;
            }
            let [xx, yy, zz, ..] = total.rotational.to_array();
            check_physical(name, total.mass, total.central(), 1e-12 * (xx + yy + zz))?;
        }
        for (number, body) in self.parts.bodies.iter().enumerate() {
            let heavy = self.inertias[number + 1].value().mass != 0.0;
            if !heavy && !self.carries(Mount::Body(number)) {
                return Err(Error::Carrier { body: body.name.clone() });
            }
        }
        Ok(())
    }

    /// Whether anything in the assembly that may weigh something sits on a mount.
    fn carries(&self, mount: Mount) -> bool {
        let Parts { bodies, beams, lines, .. } = self.parts;
        let massive = lines.iter().filter(|line| line.barrel.is_some() || line.rod.is_some());
        bodies.iter().any(|body| body.on == mount)
            || beams.iter().any(|beam| beam.on == mount)
            || massive.into_iter().any(|line| line.from.on == mount || line.to.on == mount)
    }
}

fn check_gravity<S: Scalar>(gravity: [S; 3]) -> Result<()> {
    for (axis, value) in ["x", "y", "z"].into_iter().zip(gravity) {
        if !value.is_finite() {
            return Err(Error::NonFinite { path: format!("gravity.{axis}"), value: value.inspect() });
        }
    }
    Ok(())
}

fn check_point_mass<S: Scalar>(name: &str, point: &PointMass<S>) -> Result<()> {
    let [x, y, z] = point.position;
    for (parameter, number) in [("mass", point.mass), ("x", x), ("y", y), ("z", z)] {
        if !number.is_finite() {
            return Err(Error::NonFinite { path: format!("{name}.payload.{parameter}"), value: number.inspect() });
        }
    }
    Ok(())
}

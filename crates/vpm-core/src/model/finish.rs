//! The last step of an assembly: everything in the frames and the order that the algorithms want.

use super::assemble::Assembly;
use super::omissions::Tree;
use super::order::Part;
use super::turning::turning_in_space;
use super::{BodyFrame, Elastic, Link, Model, Node, Place, Products, Shaft, Strip, Wire};
use crate::error::Result;
use crate::joint::Joint;
use crate::line::{Line, LineEnd};
use crate::mount::{Gauge, Marker, placed};
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Vector3};
use crate::transmission::{Ratio, Transmission};

/// Coordinates from which on articulated bodies are faster than a mass matrix where beams fall into segments: on arms of two links both take
/// the same time at 8 coordinates, articulated bodies three quarters of it at 14, a quarter at 44.
const MANY: usize = 10;
/// The same where each beam is one segment, whose own coordinates cost as much either way: nine tenths at 20 coordinates.
const MANY_UNCUT: usize = 20;

impl<S: Scalar> Assembly<'_, S> {
    /// Finishes an assembly: the tree.
    pub(super) fn model(mut self, order: &[Part]) -> Result<Model<S>> {
        let n_joints = self.joints.len();
        let n_coordinates = n_joints + self.beams.iter().map(|elastic| elastic.beam.len()).sum::<usize>();
        let (mut links, mut frames) = (Vec::new(), Vec::new());
        for number in 0..n_joints {
            let (link, frame) = self.link(number)?;
            links.push(link);
            frames.push(frame);
        }
        let lines = self.parts.lines.iter().map(|line| self.wire(line)).collect::<Result<Vec<_>>>()?;
        let marker = |marker: &Marker| {
            let pose = placed(&marker.name, marker.translation, marker.rotation)?;
            Ok(self.aligned(self.resolved(marker.on).beyond(pose)))
        };
        let markers = self.parts.markers.iter().map(marker).collect::<Result<_>>()?;
        let imus = self.parts.imus.iter().map(marker).collect::<Result<_>>()?;
        let attachments = self.parts.attachments.iter().map(marker).collect::<Result<_>>()?;
        let carrying = links.iter().map(|link| link.parent).chain(self.beams.iter().map(|beam| beam.root.frame));
        carrying.for_each(|frame| self.heavy[frame] = true);
        for number in 0..self.beams.len() {
            self.beams[number].root = self.aligned(self.beams[number].root);
            if let Some(first) = self.beams[number].frame {
                let own = first..first + self.beams[number].beam.stations();
                self.beams[number].inertias = self.inertias[own.clone()].to_vec();
                self.beams[number].heavy = self.heavy[own].to_vec();
            }
        }
        let sorted = links.iter().enumerate().all(|(number, link)| link.parent <= number);
        let order = self.nodes(order, &links);
        let (omissions, n_frames) = (&self.parts.omissions, self.inertias.len());
        let tree = Tree { links: &links, beams: &self.beams, lines: &lines, order: &order, n_frames };
        let products = tree.products(omissions, self.parts.drop_velocity_terms);
        let blocks = tree.blocks(omissions);
        let couples = blocks.windows(2).all(|pair| pair[0] == pair[1]);
        let uniform = products.iter().all(|each| *each == Products::Kept) || self.parts.drop_velocity_terms;
        let mut carriers = vec![false; n_frames];
        for node in &order {
            carriers[match node {
                Node::Body(number, _) => links[*number].parent,
                Node::Beam(number, _) => self.beams[*number].root.frame,
            }] = true;
        }
        let summed = self.slices(&order, &links, &products);
        let shafts: Vec<_> = self.parts.transmissions.iter().map(|shaft| shaft_of(shaft, &mut links)).collect();
        let massive = lines.iter().any(Wire::is_massive) || shafts.iter().any(|shaft| shaft.inertia.is_some());
        let closed = self.parts.closed;
        let segmented = couples && uniform && !massive && !closed;
        let cut = self.beams.iter().any(|elastic| elastic.beam.segments().len() > 1);
        let rigid = n_coordinates == n_joints && self.beams.iter().all(|elastic| elastic.frame.is_none());
        let recursive = sorted && rigid && couples && !massive && !closed;
        Ok(Model {
            gravity: Vector3::from(self.parts.gravity),
            order,
            n_frames,
            recursive,
            segmented,
            articulated: segmented && !recursive && n_coordinates >= if cut { MANY } else { MANY_UNCUT },
            carriers,
            summed,
            drops_velocity_terms: self.parts.drop_velocity_terms,
            products,
            blocks,
            couples,
            links,
            frames,
            lines,
            shafts,
            markers,
            imus,
            attachments,
            gauges: self.parts.gauges.iter().map(|gauge| self.strip(gauge)).collect(),
            beams: self.beams,
            n_coordinates,
            turned: Vec::new(),
        })
    }

    /// Finishes an assembly's slices of beams whose products of rates count, and says which frames they are.
    fn slices(&mut self, order: &[Node], links: &[Link<S>], products: &[Products]) -> Vec<bool> {
        let spatial = turning_in_space(order, links, &self.beams, products.len());
        let mut summed = vec![false; products.len()];
        for (elastic, spatial) in self.beams.iter_mut().zip(spatial) {
            let Some(first) = elastic.frame else { continue };
            let own = first..first + elastic.beam.stations();
            if products[own.clone()].iter().all(|each| *each == Products::Kept) {
                elastic.slices = elastic.beam.slices(&elastic.root.pose, spatial);
                elastic.segment_slices = elastic.beam.segment_slices(spatial).unwrap_or_default();
            }
            if let Some(slices) = &elastic.slices {
                own.enumerate().for_each(|(station, frame)| summed[frame] = slices.has(station));
            }
        }
        summed
    }

    fn link(&self, number: usize) -> Result<(Link<S>, BodyFrame<S>)> {
        let (body, joint) = (&self.parts.bodies[number], &self.joints[number]);
        let (on, inertia) = (self.resolved(body.on), self.inertias[number + 1]);
        let joint = on_frame(joint, on);
        let link = Link::new((&joint, body.rotor()?), on.frame, self.alignment(on.frame).rotation, inertia);
        Ok((link, BodyFrame { name: body.name.clone(), parent: on.frame, joint, inertia }))
    }

    fn wire(&self, line: &Line<S>) -> Result<Wire<S>> {
        line.check()?;
        let end = |end: LineEnd| {
            let point = Pose::new(Matrix3::identity(), Vector3::from_f64(end.point));
            self.aligned(self.resolved(end.on).beyond(point))
        };
        Ok(Wire { from: end(line.from), to: end(line.to), barrel: line.barrel, rod: line.rod })
    }

    fn strip(&self, gauge: &Gauge) -> Strip {
        let Elastic { beam, coordinate, .. } = &self.beams[gauge.beam];
        Strip { first: *coordinate, len: beam.len(), section: beam.gauge(gauge.at), point: [gauge.x, gauge.y] }
    }

    /// Nodes of a finished tree in their order, each with the coordinates beyond it.
    fn nodes(&self, order: &[Part], links: &[Link<S>]) -> Vec<Node> {
        let mut beyond = vec![Vec::new(); self.inertias.len()];
        let mut nodes = Vec::new();
        for part in order.iter().rev() {
            let (parent, carried, node) = match *part {
                Part::Body(number) => {
                    let mut carried: Vec<usize> = std::mem::take(&mut beyond[number + 1]);
                    let node = Node::Body(number, carried.clone());
                    carried.push(number);
                    if self.parts.omissions.coupling.contains(&number) {
                        carried.clear();
                    }
                    (links[number].parent, carried, node)
                }
                Part::Beam(number) => {
                    let Elastic { beam, root, coordinate, frame, .. } = &self.beams[number];
                    let Some(first) = *frame else { continue };
                    let at = |station: usize| beyond[first + station].iter().map(move |&place| (place, station));
                    let hanging: Vec<_> = (0..beam.stations()).flat_map(at).collect();
                    let own = *coordinate..coordinate + beam.len();
                    let carried = hanging.iter().map(|&(place, _)| place).chain(own).collect();
                    (root.frame, carried, Node::Beam(number, hanging))
                }
            };
            beyond[parent].extend(carried);
            nodes.push(node);
        }
        nodes.reverse();
        nodes
    }
}

/// Shaft of a finished tree; a rotor that one joint alone turns goes to the `links`. The recursions know it there.
fn shaft_of<S: Scalar>(transmission: &Transmission<S>, links: &mut [Link<S>]) -> Shaft<S> {
    let ratios = transmission.ratios.clone();
    if let ([Ratio { joint, ratio }], Some(inertia)) = (&*ratios, transmission.inertia) {
        links[*joint].rotor += *ratio * *ratio * inertia;
        return Shaft { ratios, inertia: None };
    }
    Shaft { ratios, inertia: transmission.inertia }
}

/// Joint of a finished tree in the frame that its mount sits on.
fn on_frame(joint: &Joint, on: Place) -> Joint {
    let frame = on.pose * joint.frame::<f64>();
    let rows = frame.rotation.transpose().columns.map(Vector3::to_array);
    let mut rotation = [0.0; 9];
    rotation.copy_from_slice(rows.as_flattened());
    Joint { translation: frame.translation.to_array(), rotation, ..joint.clone() }
}

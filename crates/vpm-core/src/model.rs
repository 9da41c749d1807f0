//! The immutable description of a machine's tree, in numbers: rigid bodies, beams, and what sits on them.

mod assemble;
mod finish;
mod omissions;
mod order;
mod place;
mod turning;

pub use assemble::Parts;
pub use omissions::Omissions;
pub(crate) use omissions::Products;
pub(crate) use place::Place;

use crate::beam::{Beam, Gauge, Slices};
use crate::body::{Body, PointMass};
use crate::error::Result;
use crate::joint::{Joint, JointKind};
use crate::line::LinePart;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Quaternion, SpatialInertia, Vector3};
use crate::transmission::Ratio;

/// A tree of rigid bodies and beams. Joint `k` carries body `k`; the coordinates are those of the joints, then the elastic ones of
/// each beam.
///
/// The recursive algorithms work in *aligned* frames: body frames turned once, at build, so that z is the joint
/// axis. A joint motion is then one component of a 6-vector instead of a product with six.
///
/// Frames that something can sit on are numbered: 0 is the world, k + 1 is body k, then come the stations of the beams.
#[derive(Clone, Debug)]
pub struct Model<S> {
    gravity: Vector3<S>,
    links: Vec<Link<S>>,
    frames: Vec<BodyFrame<S>>,
    beams: Vec<Elastic<S>>,
    order: Vec<Node>,
    lines: Vec<Wire<S>>,
    shafts: Vec<Shaft<S>>,
    markers: Vec<Place>,
    imus: Vec<Place>,
    attachments: Vec<Place>,
    gauges: Vec<Strip>,
    n_coordinates: usize,
    n_frames: usize,
    recursive: bool,
    segmented: bool,
    articulated: bool,
    /// Whether anything with coordinates hangs on each frame.
    carriers: Vec<bool>,
    /// Whether each frame is a slice of a beam that its beam's sums hold.
    summed: Vec<bool>,
    drops_velocity_terms: bool,
    /// Which products of rates count, frame by frame.
    products: Vec<Products>,
    /// The block of the mass matrix that each coordinate is in.
    blocks: Vec<usize>,
    couples: bool,
    /// Joints that begin at an orientation held beside the coordinates, with that.
    turned: Vec<(usize, Quaternion<S>)>,
}

/// A node of the tree, which comes after all that it hangs on.
#[derive(Clone, Debug)]
pub(crate) enum Node {
    /// Body of that number, and the coordinates of all that it carries.
    Body(usize, Vec<usize>),
    /// Beam of that number, and the coordinates of all that it carries, each with the station that it hangs on.
    Beam(usize, Vec<(usize, usize)>),
}

/// What the recursions need of one body, in aligned frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<S> {
    /// Number of the frame that it hangs on: 0 is the world, k + 1 is body k.
    pub(crate) parent: usize,
    pub(crate) kind: JointKind,
    /// Pose in the parent's aligned frame at coordinate zero.
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    pub(crate) inertia: SpatialInertia<S>,
    /// Inertia of the rotor, which feels the joint's acceleration alone.
    pub(crate) rotor: S,
    /// Of a screw alone: a rotation before its own, in aligned axes.
    turn: Option<Quaternion<S>>,
}

/// What a user sees of one body: its own frame, as described.
#[derive(Clone, Debug)]
pub(crate) struct BodyFrame<S> {
    pub(crate) name: String,
    /// Number of the frame that it hangs on.
    pub(crate) parent: usize,
    pub(crate) joint: Joint,
    pub(crate) inertia: SpatialInertia<S>,
}

/// A strain gauge, ready to be read.
#[derive(Clone, Debug)]
pub(crate) struct Strip {
    /// First coordinate of its beam.
    pub(crate) first: usize,
    /// Number of coordinates of its beam.
    pub(crate) len: usize,
    /// The strain of the section.
    pub(crate) section: Gauge,
    /// Its point in the section, m.
    pub(crate) point: [f64; 2],
}

impl Strip {
    /// Strain in a model's gauge per unit of each coordinate of its beam.
    pub(crate) fn row(&self) -> Vec<f64> {
        let mut row = vec![0.0; self.len];
        let [x, y] = self.point;
        self.section.add_weighted([y, -x, 0.0, 0.0, 0.0, 1.0], &mut row);
        row
    }
}

/// A beam in its place.
#[derive(Clone, Debug)]
pub(crate) struct Elastic<S> {
    pub(crate) beam: Beam<S>,
    /// Where its root is.
    pub(crate) root: Place,
    /// Its first coordinate; a rigid beam has none.
    pub(crate) coordinate: usize,
    /// Number of the frame of its first station; none for a rigid beam, whose inertia has gone to what carries it.
    pub(crate) frame: Option<usize>,
    /// Inertia at each station, with all that is welded to it.
    pub(crate) inertias: Vec<SpatialInertia<S>>,
    /// Whether a station has inertia or carries something that may, of whatever size.
    pub(crate) heavy: Vec<bool>,
    /// Its stations that are nothing but slices of a beam that bends in one plane, where these can be summed up.
    pub(crate) slices: Option<Slices<S>>,
    /// The same of each of its segments, or none.
    pub(crate) segment_slices: Vec<Slices<S>>,
}

/// The shaft of a transmission.
#[derive(Clone, Debug)]
pub(crate) struct Shaft<S> {
    /// Ratio of each joint that moves with it.
    pub(crate) ratios: Vec<Ratio<S>>,
    /// Inertia of its rotor, kg m^2; none where one joint alone turns it, whose rotor it is then.
    pub(crate) inertia: Option<S>,
}

/// A line in its place.
#[derive(Clone, Debug)]
pub(crate) struct Wire<S> {
    pub(crate) from: Place,
    pub(crate) to: Place,
    pub(crate) barrel: Option<LinePart<S>>,
    pub(crate) rod: Option<LinePart<S>>,
}

impl<S: Scalar> Model<S> {
    /// Model of a tree of rigid bodies with point masses (payloads), under `gravity` in m/s^2. Gravity is in the world
    /// frame.
    pub fn new(gravity: [f64; 3], bodies: &[Body<S>], point_masses: &[PointMass<S>]) -> Result<Self> {
        let (bodies, point_masses) = (bodies.to_vec(), point_masses.to_vec());
        let gravity = gravity.map(S::from_f64);
        Self::assemble(Parts { gravity, bodies, point_masses, ..Parts::default() })
    }

    /// Number of a model's joints and bodies.
    #[inline]
    pub fn n_joints(&self) -> usize {
        self.links.len()
    }

    /// Number of a model's coordinates: joints, then elastic coordinates beam by beam.
    #[inline]
    pub fn n_coordinates(&self) -> usize {
        self.n_coordinates
    }

    /// Number of a model's elastic coordinates.
    #[inline]
    pub fn n_elastic(&self) -> usize {
        self.n_coordinates - self.links.len()
    }

    /// Whether the algorithms for rigid trees apply to the model. That means no elastic beams, no lines with mass, no
    /// rotor that several joints turn, parents listed before their children, and a mass matrix in one piece.
    #[inline]
    pub fn is_recursive(&self) -> bool {
        self.recursive
    }

    /// Whether the recursion over bodies and segments of beams applies to the model. That means no lines with mass, no
    /// rotor that several joints turn, a mass matrix in one piece, and products of rates counted everywhere or nowhere.
    #[inline]
    pub fn is_segmented(&self) -> bool {
        self.segmented
    }

    /// Whether the articulated recursion is a model's fastest way to accelerations. It applies, and there are
    /// coordinates enough.
    #[inline]
    pub fn is_articulated(&self) -> bool {
        self.articulated
    }

    /// Whether a model's frame is a slice of a beam that its beam's sums hold.
    #[inline]
    pub(crate) fn is_summed(&self, frame: usize) -> bool {
        self.summed[frame]
    }

    /// Whether anything with coordinates hangs on a frame of the model.
    #[inline]
    pub(crate) fn is_carrier(&self, frame: usize) -> bool {
        self.carriers[frame]
    }

    /// Whether the model keeps products of rates: Coriolis, centrifugal and gyroscopic terms. Without them `h(q, v) =
    /// h(q, 0)`.
    #[inline]
    pub fn keeps_velocity_terms(&self) -> bool {
        !self.drops_velocity_terms
    }

    /// Whether the model's mass matrix is in one piece.
    #[inline]
    pub fn couples(&self) -> bool {
        self.couples
    }

    /// Products of rates that the model keeps, frame by frame.
    #[inline]
    pub(crate) fn products(&self) -> &[Products] {
        &self.products
    }

    /// Whether the model needs accelerations by products of rates of a beam's sections.
    #[inline]
    pub(crate) fn accelerates(&self, beam: usize) -> bool {
        self.beams[beam].frame.is_none_or(|first| {
            let stations = first..first + self.beams[beam].beam.stations();
            self.products[stations].iter().any(|products| products.accelerates())
        })
    }

    /// Block of the model's mass matrix that each coordinate is in.
    #[inline]
    pub(crate) fn blocks(&self) -> &[usize] {
        &self.blocks
    }

    /// Gravity of the model in m/s^2, in the world frame.
    #[inline]
    pub fn gravity(&self) -> Vector3<S> {
        self.gravity
    }

    /// Name of the model's body `k`, if there is one.
    pub fn body_name(&self, k: usize) -> Option<&str> {
        self.frames.get(k).map(|frame| frame.name.as_str())
    }

    /// Joint `k` of the model on the frame that it hangs on, if there is one.
    pub fn joint(&self, k: usize) -> Option<&Joint> {
        self.frames.get(k).map(|frame| &frame.joint)
    }

    /// Spatial inertia of the model's body `k` with all that is welded to it, if there is one. It is in the body's
    /// frame.
    pub fn inertia(&self, k: usize) -> Option<SpatialInertia<S>> {
        self.frames.get(k).map(|frame| frame.inertia)
    }

    /// Number of the model's beams, rigid ones included.
    pub fn n_beams(&self) -> usize {
        self.beams.len()
    }

    /// Beam `k` of the model and its first coordinate, if there is one.
    pub fn beam(&self, k: usize) -> Option<(&Beam<S>, usize)> {
        self.beams.get(k).map(|elastic| (&elastic.beam, elastic.coordinate))
    }

    /// Links of the model in the order of their coordinates.
    #[inline]
    pub(crate) fn links(&self) -> &[Link<S>] {
        &self.links
    }

    /// Bodies of the model in their own frames.
    #[inline]
    pub(crate) fn frames(&self) -> &[BodyFrame<S>] {
        &self.frames
    }

    /// Beams of the model.
    #[inline]
    pub(crate) fn beams(&self) -> &[Elastic<S>] {
        &self.beams
    }

    /// Bodies and elastic beams of the model, each after all that it hangs on.
    #[inline]
    pub(crate) fn order(&self) -> &[Node] {
        &self.order
    }

    /// Lines of the model.
    #[inline]
    pub(crate) fn lines(&self) -> &[Wire<S>] {
        &self.lines
    }

    /// Shafts of the model's transmissions.
    #[inline]
    pub(crate) fn shafts(&self) -> &[Shaft<S>] {
        &self.shafts
    }

    /// Number of the model's lines and shafts. These are numbered after the lines wherever a force along something is
    /// meant.
    #[inline]
    pub(crate) fn n_wires(&self) -> usize {
        self.lines.len() + self.shafts.len()
    }

    /// Markers of the model.
    #[inline]
    pub(crate) fn markers(&self) -> &[Place] {
        &self.markers
    }

    /// Inertial measurement units of the model.
    #[inline]
    pub(crate) fn imus(&self) -> &[Place] {
        &self.imus
    }

    /// Frames of the model that contacts and bushings act on.
    #[inline]
    pub(crate) fn attachments(&self) -> &[Place] {
        &self.attachments
    }

    /// Strain gauges of the model.
    #[inline]
    pub(crate) fn gauges(&self) -> &[Strip] {
        &self.gauges
    }

    /// Beam and station of a model's frame that belongs to an elastic beam.
    pub(crate) fn station(&self, frame: usize) -> Option<(usize, usize)> {
        self.beams.iter().enumerate().find_map(|(number, elastic)| {
            let station = frame.checked_sub(elastic.frame?)?;
            (station < elastic.beam.stations()).then_some((number, station))
        })
    }

    /// Number of the model's frames that something can sit on.
    #[inline]
    pub(crate) fn n_frames(&self) -> usize {
        self.n_frames
    }
}

impl<S: Scalar> Model<S> {
    /// Lets joint `k` of the model begin at an orientation that is held beside the coordinates. The joint turns; at
    /// first there is none.
    ///
    /// It becomes a screw without pitch: the same motion, out of the way of the joints that are in almost every machine.
    pub(crate) fn turn_freely(&mut self, k: usize) {
        self.links[k].kind = JointKind::Helical { pitch: 0.0 };
        self.turned.push((k, Quaternion::identity()));
        self.orient(4 * self.turned.len() - 4, S::one());
    }

    /// Orientation from which a joint of the model begins.
    pub(crate) fn orientation(&self, k: usize) -> Quaternion<S> {
        let own = self.turned.iter().find(|(joint, _)| *joint == k);
        own.map_or(Quaternion::identity(), |(_, orientation)| *orientation)
    }

    /// How many numbers [`Model::orient`] takes.
    #[inline]
    pub(crate) fn n_orientations(&self) -> usize {
        4 * self.turned.len()
    }

    /// Holds a number of an orientation from which a model's joint begins: w, x, y, z of each unit quaternion.
    pub(crate) fn orient(&mut self, place: usize, number: S) {
        let (link, turn) = &mut self.turned[place / 4];
        let Quaternion { real, vector } = turn;
        match place % 4 {
            0 => *real = number,
            1 => vector.x = number,
            2 => vector.y = number,
            _ => vector.z = number,
        }
        let aligned = lift(self.frames[*link].joint.alignment()).transpose_mul(turn.vector);
        self.links[*link].turn = Some(Quaternion { real: turn.real, vector: aligned });
    }
}

impl<S: Scalar> Wire<S> {
    /// Whether a line or shaft of the model weighs anything.
    #[inline]
    pub(crate) fn is_massive(&self) -> bool {
        self.barrel.is_some() || self.rod.is_some()
    }
}

impl<S: Scalar> Link<S> {
    /// Link of the model: a body with its joint, on a frame with that alignment of its own.
    fn new(
        (joint, rotor): (&Joint, S),
        parent: usize,
        parent_alignment: Matrix3<f64>,
        inertia: SpatialInertia<S>,
    ) -> Self {
        let alignment = joint.alignment();
        let frame: Pose<f64> = joint.frame();
        let to_aligned = Pose::new(lift(alignment).transpose(), Vector3::zero());
        Self {
            parent,
            kind: joint.kind,
            rotation: parent_alignment.transpose() * frame.rotation * alignment,
            translation: parent_alignment.transpose_mul(frame.translation),
            inertia: to_aligned.inertia(inertia),
            rotor,
            turn: None,
        }
    }

    /// Pose `X_PB` of a model's body in its parent at coordinate `q`, both in aligned frames.
    #[inline]
    pub(crate) fn pose(&self, q: S) -> Pose<S> {
        let [.., z] = self.rotation.columns;
        let translation = Vector3::from_f64(self.translation.to_array());
        match self.kind {
            JointKind::Prismatic => Pose::new(lift(self.rotation), translation + scaled(z, q)),
            JointKind::Revolute => Pose::new(self.turned(q), translation),
            JointKind::Helical { pitch } => self.screwed(q, pitch),
        }
    }

    /// Pose of a model's screw joint; out of the way of the other two kinds, which are in almost every machine.
    #[cold]
    fn screwed(&self, q: S, pitch: f64) -> Pose<S> {
        if let Some(turn) = self.turn {
            let [x, y, z] = (lift(self.rotation) * turn.rotation()).columns;
            let (sine, cosine) = q.sin_cos();
            let rotation = Matrix3::from_columns(x * cosine + y * sine, y * cosine - x * sine, z);
            return Pose::new(rotation, Vector3::from_f64(self.translation.to_array()));
        }
        let along = scaled(self.rotation.columns[2], q * pitch);
        Pose::new(self.turned(q), Vector3::from_f64(self.translation.to_array()) + along)
    }

    #[inline]
    fn turned(&self, angle: S) -> Matrix3<S> {
        let [x, y, z] = self.rotation.columns;
        let (sine, cosine) = angle.sin_cos();
        Matrix3::from_columns(
            scaled(x, cosine) + scaled(y, sine),
            scaled(y, cosine) - scaled(x, sine),
            Vector3::from_f64(z.to_array()),
        )
    }
}

/// Constant vector of the model times a number. That is cheaper than a product of two numbers that carry derivatives.
#[inline]
fn scaled<S: Scalar>(v: Vector3<f64>, factor: S) -> Vector3<S> {
    Vector3::new(factor * v.x, factor * v.y, factor * v.z)
}

#[inline]
fn lift<S: Scalar>(matrix: Matrix3<f64>) -> Matrix3<S> {
    Matrix3 { columns: matrix.columns.map(|column| Vector3::from_f64(column.to_array())) }
}

//! What can go wrong, as data: which part, the failing condition, the numbers and the repair, in one sentence each.

pub use connection::ConnectionError;
pub use drive::DriveError;
pub use narx::NarxError;

mod connection;
mod drive;
mod narx;

/// An input or a computation that has no physical meaning.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is infinite or not a number.
    #[error("`{path}` must be a finite number, got {value}; check the value and its unit")]
    NonFinite {
        /// Dotted name, for example `carriage.mass`.
        path: String,
        /// The value found.
        value: f64,
    },
    /// A machine is not held by any effort where it was asked for.
    #[error(
        "the effort that holds joint `{joint}` at rest is {value}: a spring acts along a line that has no length in this \
         pose; name another pose"
    )]
    NoHold {
        /// Name of the joint.
        joint: String,
        /// The value found.
        value: f64,
    },
    /// A machine has no derivative where it was asked for.
    #[error(
        "row {row} and column {column} of {matrix}, counted from 0, is {value}: a law has no derivative at this state, \
         such as a line of no length, or a flow without a difference of pressure; name another state"
    )]
    NoDerivative {
        /// Name of the matrix.
        matrix: &'static str,
        /// Row of the entry, from 0.
        row: usize,
        /// Column of the entry, from 0.
        column: usize,
        /// What the entry is.
        value: f64,
    },
    /// A body's mass, with its payloads, is zero or negative.
    #[error(
        "`{body}.mass` must be positive with all payloads included, got {mass} kg; give every body the mass it moves with"
    )]
    Mass {
        /// Name of the body.
        body: String,
        /// Total mass in kg.
        mass: f64,
    },
    /// No distribution of positive mass has this rotational inertia.
    #[error(
        "`{body}.inertia` belongs to no real body: its principal moments {moments:?} kg m^2 must be non-negative and \
         the largest may not exceed the sum of the other two; check signs, units and that it is taken about the centre of mass"
    )]
    Inertia {
        /// Name of the body.
        body: String,
        /// Principal moments about the centre of mass in kg m^2, ascending.
        moments: [f64; 3],
    },
    /// A body's parent does not come before the body.
    #[error(
        "body `{body}` (number {index}) has parent number {parent}, but a parent must be one of the earlier bodies; \
         list every parent before its children"
    )]
    Parent {
        /// Name of the body.
        body: String,
        /// Its position in the list, from 0.
        index: usize,
        /// The parent asked for.
        parent: usize,
    },
    /// Parts that hang on each other in a ring.
    #[error(
        "`{}` hang on each other in a ring, but from every part of a tree one way leads to the world; hang one of them on the \
         world or on a part that is not of the ring", names.join("`, `")
    )]
    Loop {
        /// Names of the bodies and beams in the ring, each before what it hangs on.
        names: Vec<String>,
    },
    /// A body without mass that carries nothing.
    #[error(
        "`{body}` has no inertia and carries nothing that has, so its joint moves nothing; give it an inertia or hang a body on it"
    )]
    Carrier {
        /// Name of the body.
        body: String,
    },
    /// A section that lies outside of its beam.
    #[error(
        "{what} sits on beam `{beam}` at {at} m, but the beam ends at {length} m; give an arc length from 0 to {length} m"
    )]
    Section {
        /// What sits there, for example ``marker `tip` ``.
        what: String,
        /// Name of the beam.
        beam: String,
        /// The arc length asked for, m.
        at: f64,
        /// Length of the beam, m.
        length: f64,
    },
    /// Inverse dynamics of a machine whose beams are elastic.
    #[error(
        "the motion of the joints alone does not tell the efforts of a machine with the elastic beam `{beam}`, whose own motion counts \
         too; simulate it with prescribed joint motion, or make its beams rigid"
    )]
    Flexible {
        /// Name of the first such beam.
        beam: String,
    },
    /// A payload sits on a body that does not exist.
    #[error(
        "payload number {payload} sits on body number {body}, but the model has {bodies} bodies; use a number below {bodies}"
    )]
    PayloadBody {
        /// Position of the payload in the list, from 0.
        payload: usize,
        /// The body asked for.
        body: usize,
        /// How many bodies there are.
        bodies: usize,
    },
    /// A joint axis is not a unit vector.
    #[error(
        "`{joint}.axis` {axis:?} has length {length}, but must be a unit vector within 0.001; divide it by its length"
    )]
    Axis {
        /// Name of the joint.
        joint: String,
        /// The axis found.
        axis: [f64; 3],
        /// Its length.
        length: f64,
    },
    /// The rotation of a joint frame is not a rotation matrix.
    #[error(
        "`{joint}.rotation` is no rotation: R R^T differs from the identity by {defect} and det R = {determinant}; \
         give an orthonormal right-handed matrix, row by row"
    )]
    Rotation {
        /// Name of the joint.
        joint: String,
        /// Largest entry of |R R^T - 1|.
        defect: f64,
        /// Determinant of R, +1 for a rotation.
        determinant: f64,
    },
    /// A joint moves no inertia, so that a force would give it an infinite acceleration.
    #[error(
        "joint `{joint}` moves no inertia along its own motion (articulated inertia {inertia:e}), so its acceleration is \
         undefined; give its body a rotational inertia about the axis or move the centre of mass off the axis"
    )]
    SingularJoint {
        /// Name of the joint.
        joint: String,
        /// Articulated inertia along the joint motion, kg or kg m^2.
        inertia: f64,
    },
    /// An array has the wrong length.
    #[error("{what} must have {expected} entries, got {found}; pass one entry per {each}")]
    Dimension {
        /// Which array.
        what: String,
        /// Entries needed.
        expected: usize,
        /// Entries found.
        found: usize,
        /// What one entry stands for.
        each: String,
    },
    /// The model description is not what it should be.
    #[error("the model description cannot be read: {message}; write it as the model loader does")]
    Description {
        /// What the reader says, with the place.
        message: String,
    },
    /// Times of a loop cannot be recorded.
    #[error("the times of the loop cannot be recorded: {message}; report it")]
    Timer {
        /// What the recorder says.
        message: String,
    },
    /// A compiled model is not what it should be.
    #[error("the compiled model cannot be read: {message}")]
    Compiled {
        /// What is wrong, and the repair.
        message: String,
    },
    /// Something in the description points at something that is not there.
    #[error("{what} refers to {target} number {index}, but there are {count}; use a number below {count}")]
    Reference {
        /// What holds the reference, for example ``actuator `drive` ``.
        what: String,
        /// What kind of thing it refers to.
        target: &'static str,
        /// The number asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Two parts of a model claim the same place.
    #[error("`{second}` and `{first}` both {claim}; remove one of them")]
    Twice {
        /// The part that came first.
        first: String,
        /// The part that came second.
        second: String,
        /// What both do.
        claim: String,
    },
    /// A parameter lies where its law is not defined.
    #[error("`{path}` must {condition}, got {value}; give it another value or remove what it belongs to")]
    Domain {
        /// Dotted name, for example `axis.friction.transition_velocity`.
        path: String,
        /// The condition, after "must".
        condition: &'static str,
        /// The value found.
        value: f64,
    },
    /// A step control that does not get on.
    #[error("state number {state} {event} from {reached} s on, in steps of {step:.3e} s; {repair}")]
    Steps {
        /// The state that stops it, from 0.
        state: usize,
        /// What the state does that no step can follow.
        event: String,
        /// How far the steps led, s.
        reached: f64,
        /// Length of the last step, s.
        step: f64,
        /// What to do.
        repair: &'static str,
    },
    /// No integrator has this name.
    #[error(
        "there is no integrator `{name}`; use semi_implicit, rk4, linearly_implicit, rosenbrock, additive, crank_nicolson, \
         guarded, adaptive or, with a tolerance, adaptive(1e-8)"
    )]
    Integrator {
        /// The name asked for.
        name: String,
    },
    /// A name that is no hold of inputs.
    #[error("unknown hold '{name}'; choose zero_order, first_order or cubic")]
    Hold {
        /// The name asked for.
        name: String,
    },
    /// An explicit step that is too long for the fastest vibration or decay of a system.
    #[error(
        "a step of {step:.3e} s is too large for {method}: the mode that moves `{coordinate}` most, at {frequency:.4} Hz, is stable \
         up to {limit:.3e} s; use more substeps or the integrator linearly_implicit or rosenbrock"
    )]
    StepTooLarge {
        /// Name of the integrator.
        method: &'static str,
        /// The step asked for, in s.
        step: f64,
        /// The coordinate with the largest part in the mode.
        coordinate: String,
        /// Natural frequency of the mode in Hz.
        frequency: f64,
        /// Largest stable step in s.
        limit: f64,
    },
    /// The adaptive reference solver gave up.
    #[error(
        "the reference solution was not reached: {message}; loosen the tolerance, or check the equations where it stopped"
    )]
    ReferenceSolution {
        /// What the solver says.
        message: String,
    },
    /// A setting of a computation is out of range.
    #[error("{setting} must {condition}, got {value}; {repair}")]
    Setting {
        /// Which setting.
        setting: &'static str,
        /// The condition, after "must".
        condition: String,
        /// The value found.
        value: f64,
        /// What to do.
        repair: &'static str,
    },
    /// A closed loop without controllers.
    #[error("the machine has no controller, so no loop is closed; give it one or simulate with measured commands")]
    OpenLoop,
    /// A drive or a supply that cannot be as described.
    #[error("{0}")]
    Drive(#[from] DriveError),
    /// A contact, a bushing or a load cell that has no physical meaning.
    #[error("{0}")]
    Connection(#[from] ConnectionError),
    /// A controller or a drive whose samples fall between those of the record.
    #[error(
        "{kind} `{name}` samples every {sample_time} s, which is no whole multiple of the record's time step of {time_step} s; \
         give it the sample_time {nearest} s, or resample the record"
    )]
    SampleTime {
        /// What it is: controller or actuator.
        kind: &'static str,
        /// Its name.
        name: String,
        /// Time between its samples, s.
        sample_time: f64,
        /// Time between the samples of the record, s.
        time_step: f64,
        /// The multiple next to it, s.
        nearest: f64,
    },
    /// A NARX model that cannot be as described, or records that cannot tell it.
    #[error("{0}")]
    Narx(Box<NarxError>),
    /// A computation left the finite numbers.
    #[error("{0}")]
    Diverged(Box<Diverged>),
    /// A law that decides by the value of a number, where equations for all values are asked for.
    #[error("the machine has no equations that can be written out: {place} decides by the value of {what}")]
    Unrecorded {
        /// Where in the core.
        place: String,
        /// What it looks at, and what can be done.
        what: String,
    },
    /// A name that C does not take.
    #[error(
        "`{name}` is no name for functions of C; give one of letters, digits and underscores that begins with a letter"
    )]
    SourceName {
        /// The name given.
        name: String,
    },
    /// A ball joint whose angles are no coordinates.
    #[error(
        "joint `{joint}` is at the singularity of its angles: the second is {angle:.4} degrees, where their accelerations have no bound; \
         take a state away from 90 degrees, or turn the frame of the joint"
    )]
    Angles {
        /// Name of the joint.
        joint: String,
        /// Its second angle, degrees.
        angle: f64,
    },
    /// The caller asked to stop.
    #[error("the computation was interrupted; start it again to get its result")]
    Interrupted,
}

impl From<NarxError> for Error {
    fn from(error: NarxError) -> Self {
        Self::Narx(Box::new(error))
    }
}

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A simulation that left the finite numbers or that no steps can follow, with what it had computed until then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} {event} at t = {time:.6} s (sample {sample_index}) with {method} in steps of {step:.3e} s; {repair}")]
pub struct Diverged {
    /// Which quantity, for example ``the velocity of joint `axis` ``.
    pub what: String,
    /// What it does that no simulation can follow: "is no longer finite" as a rule.
    pub event: String,
    /// Time after the first sample, in s.
    pub time: f64,
    /// First sample that is missing; in a restart, counted in the log.
    pub sample_index: usize,
    /// Name of the integrator, with its tolerance if it has one.
    pub method: String,
    /// Step of the integrator in s.
    pub step: f64,
    /// What to do.
    pub repair: &'static str,
    /// Outputs of the samples before, row by row.
    pub outputs: Vec<f64>,
    /// States of the samples before, row by row.
    pub states: Vec<f64>,
}

impl Diverged {
    /// What becomes of a quantity whose number is infinite or none.
    pub const NOT_FINITE: &'static str = "is no longer finite";
}

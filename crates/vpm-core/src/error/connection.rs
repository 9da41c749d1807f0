//! What can go wrong with contacts, bushings and load cells.

/// A contact, a bushing or a load cell that has no physical meaning.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// A point of the world against a plane of the world.
    #[error(
        "contact `{contact}` is on the world, where it cannot move against its plane; put it on a body or on a beam that moves"
    )]
    OnWorld {
        /// Name of the contact.
        contact: String,
    },
    /// Friction that does not fall over a range of velocities.
    #[error(
        "contact `{contact}` has the static velocity {static_velocity} m/s and the dynamic velocity {dynamic_velocity} m/s, but friction \
         falls from the one to the other; give a dynamic velocity above the static one"
    )]
    Velocities {
        /// Name of the contact.
        contact: String,
        /// Velocity at which static friction is reached, m/s.
        static_velocity: f64,
        /// Velocity from which dynamic friction holds, m/s.
        dynamic_velocity: f64,
    },
    /// A bushing that never deforms.
    #[error(
        "bushing `{bushing}` has both ends on what moves as one piece, so it never deforms; put one end on another body or beam"
    )]
    OnePiece {
        /// Name of the bushing.
        bushing: String,
    },
    /// A loop that is none.
    #[error(
        "loop `{closure}` has both ends on what moves as one piece, so it closes nothing; put one end on another body or beam"
    )]
    LoopOnOnePiece {
        /// Name of the loop.
        closure: String,
    },
    /// A loop in a model that leaves out what keeps it closed.
    #[error(
        "loop `{closure}` cannot stay closed in a model that leaves out velocity terms or couplings; put velocity_terms and \
         inertia_coupling back, or remove the loop"
    )]
    LoopWithoutTerms {
        /// Name of the loop.
        closure: String,
    },
    /// A state in which loops are open.
    #[error(
        "the state leaves loop `{closure}` open by {gap:.4e} (m, or the cosine of an angle that has to be a right one); close the loops first, \
         as model.state does"
    )]
    LoopOpen {
        /// Name of the loop.
        closure: String,
        /// Largest gap.
        gap: f64,
    },
    /// A state whose rates tear loops.
    #[error(
        "the velocities of the state tear loop `{closure}` apart at {rate:.4e} m/s or rad/s; give those of the independent joints to \
         model.state, which finds the others"
    )]
    LoopTorn {
        /// Name of the loop.
        closure: String,
        /// How fast.
        rate: f64,
    },
    /// Something that is not known of machines with closed loops.
    #[error("{what} is not known for machines with closed loops (`{closure}`); {repair}")]
    LoopRefused {
        /// Name of the loop.
        closure: String,
        /// What was asked for.
        what: &'static str,
        /// What to do instead.
        repair: &'static str,
    },
    /// A stiffness without potential.
    #[error(
        "bushing `{bushing}` has the stiffness {above} in row {row}, column {column}, but {below} in row {column}, column {row}; \
         a spring has a symmetric stiffness, so make them equal"
    )]
    NotSymmetric {
        /// Name of the bushing.
        bushing: String,
        /// Row of the entry above the diagonal: rx, ry, rz, x, y or z.
        row: &'static str,
        /// Its column.
        column: &'static str,
        /// The entry.
        above: f64,
        /// The one on the other side of the diagonal.
        below: f64,
    },
    /// A stiffness or damping that gives energy away.
    #[error(
        "bushing `{bushing}` has a {matrix} that is not positive semidefinite: scaled to a diagonal of 1, its smallest eigenvalue is \
         {eigenvalue:.4e}; make the entries off the diagonal smaller"
    )]
    NotPositive {
        /// Name of the bushing.
        bushing: String,
        /// Which matrix.
        matrix: &'static str,
        /// Smallest eigenvalue of the scaled symmetric part.
        eigenvalue: f64,
    },
}

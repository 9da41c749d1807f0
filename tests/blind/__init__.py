"""A proving ground for the diagnosis, blind: machines simulated by other code, with effects hidden in them.

Nothing here uses the package's simulation. Friction sticks instead of creeping, play opens and closes, delays are
buffers, encoders count, and flexible links are fields with many more coordinates than any model of them has; what the
diagnosis finds, it finds in somebody else's data.

    from blind import hideable, make_case, make_cases

    case = make_case("axis_linear", "coulomb_friction", seed=7)
    case.model()                      # the nominal model: parameters up to 10 % off, the effect missing
    case.train, case.validate         # two records to fit, one to judge, as vpm.Experiment
    case.truth.hidden                 # what is missing: name, site, parameters, known to the catalogue or not
    case.oracle.strength              # how far it stands clear of the noise after a recalibration; solvable above 1

    make_cases("axis_linear", [(name, seed) for name in hideable("axis_linear") for seed in range(5)])

A batch is simulated side by side and takes little longer than one case, so ask for many at once. All cases of a seed
have one machine and one set of motions, and share what is simulated without their effects: ask for the cases of a seed
together. Beside effects there are the cases ``"none"`` and ``"parameters"``, and several effects as a tuple.

    case.write(Path("case"))          # model.toml, train_1.csv, train_2.csv, validate.csv, truth.json

The sites are those of the model files. At ``"world"``, a tilt turns gravity about the axis of a joint in the vertical
plane (positive angles as those of the joint), and in the flexible arm into the level plane, towards -y.

``vpm prove`` diagnoses many cases and counts what was named: docs/proving_ground.md.

=================  ===================================================================================================
``case.py``        ``make_case``, ``make_cases``
``batch.py``       the truth; records side by side
``oracle.py``      whether a case can be solved
``effects.py``     what can be hidden, and how large
``machine.py``     what a machine has to say of itself
``machines/``      one file each
``loads.py``       friction, springs, ripple, hysteresis, stops of joints
``driveline.py``   rotors, gears and the links behind them in time
``chain.py``       flexible links
``hydraulics.py``  valves, cylinders, pump
``loop.py``        sensors, controllers, drives
``motion.py``      references
``noise.py``       noise and counts
``proving.py``     which cases, made and diagnosed on many cores
``answer.py``      what a diagnosis answers to a case
``score.py``       what counts as right
``table.py``       the tables
=================  ===================================================================================================
"""

from blind.batch import Hidden, Truth
from blind.case import Case, hideable, make_case, make_cases, sites_of, try_cases
from blind.effects import EFFECTS
from blind.machines import MACHINES
from blind.oracle import Oracle

__all__ = [
    "EFFECTS",
    "MACHINES",
    "Case",
    "Hidden",
    "Oracle",
    "Truth",
    "hideable",
    "make_case",
    "make_cases",
    "sites_of",
    "try_cases",
]

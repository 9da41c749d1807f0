"""What the catalogue says about an effect and about each of its parameters."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Literal, get_args

from vpm.catalogue.formula import Formula
from vpm.catalogue.signature import ANYWHERE, Signature
from vpm.catalogue.traits import Traits
from vpm.errors import ModelError, near_match

#: A cylinder is a hydraulic actuator with its valve, named as it.
SiteKind = Literal["joint", "body", "link", "beam", "actuator", "cylinder", "supply", "sensor", "world"]
SITE_KINDS: tuple[SiteKind, ...] = get_args(SiteKind)

JointKind = Literal["prismatic", "revolute", "helical"]

#: Where at a joint with a compliance or backlash: before the spring or gap, on the coordinate of the joint, or behind
#: it, on the sum of that and the deflection.
Side = Literal["motor", "link"]


def in_words(at: str, side: Side) -> str:
    """Component and side of an effect kind in words; of the motor side nothing is said."""
    return at if side == "motor" else f"{at}, {side} side"


#: What in a record sets the natural size of a parameter; "one" means that the parameter is near 1 by nature.
Scale = Literal[
    "effort",
    "effort_per_speed",
    "effort_per_speed_squared",
    "effort_per_coordinate",
    "effort_per_coordinate_cubed",
    "coordinate",
    "speed",
    "mass",
    "inertia",
    "one_per_speed",
    "time",
    "command",
    "channel",
    "leakage",
    "resistance",
    "one",
]

#: What sets the size of a parameter, by its unit; "one" where the unit is another one.
SCALES: Mapping[str, Scale] = {
    "{E}": "effort",
    "{E} s/{C}": "effort_per_speed",
    "{E} s^2/{C}^2": "effort_per_speed_squared",
    **dict.fromkeys(("{E}/{C}", "N m/rad"), "effort_per_coordinate"),
    "{E}/{C}^3": "effort_per_coordinate_cubed",
    **dict.fromkeys(("{C}", "m"), "coordinate"),
    "{C}/s": "speed",
    "kg": "mass",
    **dict.fromkeys(("{E} s^2/{C}", "kg m^2"), "inertia"),
    "s/{C}": "one_per_speed",
    "s": "time",
    "{U}": "command",
    "{S}": "channel",
    "m^3/(s Pa)": "leakage",
    "Pa s/m^3": "resistance",
}

Range = tuple[float, float]

#: Least value of what has to be positive: "greater than zero" as a closed bound, far below anything measurable.
POSITIVE = 1e-9

ANY: Range = (-math.inf, math.inf)
NOT_NEGATIVE: Range = (0.0, math.inf)
ABOVE_ZERO: Range = (POSITIVE, math.inf)


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect.

    Attributes
    ----------
    name : str
        Short name: the key in a model file and the keyword of ``with_effect``.
    unit : str
        Template, for example ``"{E} s/{C}"``.
    meaning : str
        Half a sentence for reference pages.
    scale : str
        What in a record sets its natural size, see `Scale`.
    suffix : str
        What follows the site in the dotted name: ``friction.viscous`` makes ``axis.friction.viscous``. By default the
        group of its effect and its name.
    neutral : float or None
        Value at which the effect is not there (SI); None for a parameter that no value switches off.
    start : float or (float, float) or None
        Value when none is given (SI); a pair is for a site that shifts and one that turns; None: it has to be given.
    physical : (float, float)
        Range outside which the value contradicts physics (SI, closed).
    evaluable : (float, float)
        Range in which the law gives finite numbers (SI, closed); a screening may leave the physical range inside this
        one, to see that the data prefer an impossible sign.
    linear : bool
        The effort that a motion needs is linear in this parameter, the shape parameters being fixed.
    shape : bool
        Shapes a law whose size another parameter gives; has no meaning where that size is zero.
    learnt : bool
        Shape that nobody knows beforehand, so that data decide unless a value is given: adjustable in an added effect.
    typical : float
        Order of magnitude (SI) of a value that matters, for numbers that are far from 1 by their unit.
    optional : bool
        Not there at all unless a value is given.
    """

    name: str
    unit: str
    meaning: str
    _: KW_ONLY
    scale: Scale
    suffix: str = ""
    neutral: float | None
    start: float | tuple[float, float] | None
    physical: Range
    evaluable: Range = ANY
    linear: bool = False
    shape: bool = False
    learnt: bool = False
    typical: float = 1.0
    optional: bool = False

    @property
    def is_place(self) -> bool:
        """Whether the parameter says where along its way an effect lies, which may be anywhere."""
        return self.shape and tuple(self.physical) == ANY

    def default(self, kind: JointKind | None = None) -> float | None:
        """Value when none is given (SI), at a site on a joint of this kind; None if it has to be given.

        ``kind``: one of "prismatic", "revolute", "helical".
        """
        if isinstance(self.start, tuple):
            return self.start[1] if kind in {"revolute", "helical"} else self.start[0]
        return self.start


@dataclass(frozen=True, kw_only=True)
class EffectType(Traits):
    """One physical effect: its words and numbers, and its traits.

    Attributes
    ----------
    site : {"joint", "body", "link", "beam", "actuator", "cylinder", "supply", "sensor", "world"}
        Kind of component that it sits at; what sits at a body may sit at a beam too, in the frame of its tip. A link is
        a body that its joint turns, or a beam; the world is one site, where there is gravity.
    group : str
        First part of the suffix of its parameters.
    law : str
        The law as text.
    sentence : str
        For a report; the template knows ``{at}`` and the short names of the parameters, as text with unit.
    impossible : str
        What a value outside the physical range would mean.
    confused_with : mapping of str to str
        Effects that records may not tell from this one, and what tells them apart; of two effects one has to say it.
    signature : Signature
        Where it shows: the state that its picture is drawn over, and what is to be seen there.
    formula : Formula or None
        Law of an entry that a user wrote, see `vpm.catalogue.register`.
    """

    name: str
    site: SiteKind
    group: str
    parameters: tuple[EffectParameter, ...]
    law: str
    sentence: str
    impossible: str
    confused_with: Mapping[str, str] = field(default_factory=dict)
    signature: Signature = ANYWHERE
    formula: Formula | None = None

    def __post_init__(self) -> None:
        """Name the parameters of an effect after its group."""
        named = (replace(one, suffix=one.suffix or f"{self.group}.{one.name}") for one in self.parameters)
        object.__setattr__(self, "parameters", tuple(named))

    @property
    def has_law(self) -> bool:
        """Whether a kind of effect has a law of its own, and is no form for what no law explains."""
        return any(not parameter.shape and not parameter.optional for parameter in self.parameters)

    @property
    def has_sides(self) -> bool:
        """Whether a kind of effect may sit on either side of a compliance or backlash."""
        return self.site == "joint" and not self.motor_side_alone

    @property
    def rubs(self) -> bool:
        """Whether a kind of effect is friction: it turns round with the motion, within a transition velocity."""
        return any(parameter.name == "transition_velocity" for parameter in self.parameters)

    @property
    def adds_inertia(self) -> bool:
        """Whether a mass or an inertia is among the parameters of a kind of effect."""
        return any(parameter.scale in {"mass", "inertia"} for parameter in self.parameters)

    @property
    def is_load(self) -> bool:
        """Whether a kind of effect is a mass somewhere on a body."""
        return self.site == "body" and self.adds_inertia and any(one.is_place for one in self.parameters)

    @property
    def title(self) -> str:
        """Name of a kind of effect in words: ``"Coulomb friction"``."""
        words = self.name.replace("_", " ")
        return words.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck").replace("lugre", "LuGre")

    def parameter(self, name: str) -> EffectParameter:
        """Parameter of a kind of effect by its short name."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        repair = near_match(name, (p.name for p in self.parameters), what="its parameters are")
        raise ModelError(f'the effect {self.name} has no parameter "{name}"; {repair}', where=name)


def size(
    name: str,
    unit: str,
    meaning: str,
    *,
    physical: Range = ANY,
    neutral: float = 0.0,
    linear: bool = True,
    suffix: str = "",
) -> EffectParameter:
    """Kind of parameter: size of a law, in which the effort is linear unless said otherwise."""
    return EffectParameter(
        name,
        unit,
        meaning,
        scale=SCALES.get(unit, "one"),
        suffix=suffix,
        neutral=neutral,
        start=neutral,
        physical=physical,
        linear=linear,
    )


def shape(
    name: str,
    unit: str,
    meaning: str,
    *,
    start: float | tuple[float, float] | None,
    bounds: Range = ABOVE_ZERO,
    learnt: bool = False,
    suffix: str = "",
) -> EffectParameter:
    """Kind of parameter: shape; law and physics have the same range."""
    sized = size(name, unit, meaning, physical=bounds, linear=False, suffix=suffix)
    return replace(sized, neutral=None, start=start, evaluable=bounds, shape=True, learnt=learnt)


def nonlinear(
    name: str,
    unit: str,
    meaning: str,
    *,
    neutral: float,
    physical: Range,
    evaluable: Range,
    typical: float = 1.0,
) -> EffectParameter:
    """Kind of parameter: size of an effect in which nothing is linear."""
    sized = size(name, unit, meaning, physical=physical, neutral=neutral, linear=False)
    return replace(sized, evaluable=evaluable, typical=typical)

"""What of a model can be made simpler: effects and terms left out, links coarser, drives with less oil.

Each place of a model where something can be simpler is a *site* with a list of *changes* that exclude each other; a
reduced model takes one change, or none, at each site.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import Side, in_words
from vpm.errors import VpmError
from vpm.model import Model
from vpm.model.beams.level import deforms_of, size_of
from vpm.results import Storable
from vpm.simplify.hydraulics import hydraulic_drives, possible_changes, simpler
from vpm.simplify.terms import MACHINE, removable, terms_site, without_terms

#: Levels that a flexible link is offered, where they have fewer coordinates than its own; docs/beams.md compares them.
#: Polynomials of the strain are not among them: they bend as Bezier curves of one degree more do.
OFFERED = (
    "elements(8)",
    "bezier(4)",
    "bezier(3)",
    "bezier(2)",
    "modal(2)",
    "modal(1)",
    "lumped(2)",
    "lumped(1)",
    "rigid",
)
#: The same of a reduced solid.
OFFERED_SOLID = ("reduced(8)", "reduced(4)", "reduced(2)", "reduced(1)", "rigid")
#: Component that a link needs, because its joints or loads live in it, is never held rigid: bending.
HELD_FIRST = ("extension", "shear_x", "shear_y", "torsion")


@dataclass(frozen=True)
class Reduction(Storable):
    """One change that makes a model simpler.

    Attributes
    ----------
    kind : {"effect", "level", "component", "drive", "terms"}
        An effect left out, a coarser level of a flexible link, a deformation held rigid, a hydraulic drive with fewer
        states, or terms of the equations of motion left out.
    name : str
        Effect, level, component, change of a drive, see `vpm.simplify.hydraulics`, or of terms ``"velocity"`` (products
        of rates), ``"coupling"`` (entries of the mass matrix across joints), ``"second-order"`` (in the deflection).
    at : str
        Site of the effect, flexible link, drive; of Coriolis and centrifugal terms bodies and links, of coupling
        joints, with commas between them, or ``"the machine"``.
    side : {"motor", "link"}
        Of an effect at a joint with a compliance or backlash.
    """

    kind: str
    name: str
    at: str
    side: Side = field(default="motor", kw_only=True)

    def __str__(self) -> str:
        match self.kind:
            case "level":
                return f"{self.at} as {self.name}"
            case "component":
                return f"{self.at} rigid in {self.name}"
            case "drive":
                return f"{self.at} with {self.name}"
            case "terms":
                return f"{self.at} without {self.name} terms"
        return f"without {self.name} at {in_words(self.at, self.side)}"

    @property
    def site(self) -> tuple[str, str]:
        """Kind and place of a reduction; reductions of one site exclude each other."""
        if self.kind == "terms":
            return (f"terms {self.name}", terms_site(self.name, self.at))
        alone = self.kind in ("level", "drive")
        return (
            self.kind if alone else f"{self.kind} {self.name}",
            self.at if self.side == "motor" else f"{self.at}.{self.side}",
        )

    def applied(self, model: Model) -> Model:
        """Model with one reduction done."""
        match self.kind:
            case "effect":
                return model.without_effect(self.name, self.at, self.side)
            case "level":
                return model.at({self.at: self.name})
            case "drive":
                return simpler(model, self.at, self.name)
            case "terms":
                return without_terms(model, self.name, self.at)
        content = model.to_dict()
        beam = content["beams"][self.at]
        beam["deforms"] = [component for component in deforms_of(beam) if component != self.name]
        return type(model)(content)


#: Products of rates, and entries of the mass matrix across joints, left out of the whole machine.
VELOCITY_TERMS, COUPLING_TERMS = (Reduction("terms", name, MACHINE) for name in ("velocity", "coupling"))


def reductions(model: Model, learnt: Iterable[Reduction] = ()) -> dict[tuple[str, str], tuple[Reduction, ...]]:
    """Reductions of a model that are possible, by site.

    ``learnt``: more of them, which records tell: `vpm.simplify.surrogates`.
    Result: those of which the reduced model is a valid one. Levels of a link come finest first.
    """
    found: dict[tuple[str, str], tuple[Reduction, ...]] = {}
    for reduction in (*_imaginable(model), *learnt):
        if _possible(model, reduction):
            found[reduction.site] = (*found.get(reduction.site, ()), reduction)
    return found


def reduced(model: Model, changes: Sequence[Reduction]) -> Model:
    """Model with several reductions done.

    ``changes``: at most one of each site.
    Raises `ModelError`: they contradict each other.
    """
    # A rigid link has no components, and a spool that follows at once no effect that slows it: those come last.
    # A play goes before the spring that it may be in series with.
    for change in sorted(changes, key=lambda each: (each.kind in ("level", "drive"), not _is_play(each))):
        model = change.applied(model)
    return model


def _is_play(change: Reduction) -> bool:
    return change.kind == "effect" and EFFECTS[change.name].has_play


def _imaginable(model: Model) -> Iterator[Reduction]:
    for effect in model.effects:
        yield Reduction("effect", effect.name, effect.at, side=effect.side)
    for name, beam in _beams(model).items():
        deforms = deforms_of(beam)
        own = size_of(beam["level"], beam)
        for level in OFFERED_SOLID if "reduced" in beam else OFFERED:
            if size_of(level, beam) < own:
                yield Reduction("level", level, name)
        for component in HELD_FIRST:
            if component in deforms and len(deforms) > 1:
                yield Reduction("component", component, name)
    for drive in hydraulic_drives(model):
        for change in possible_changes(model, drive):
            yield Reduction("drive", change, drive)
    for name, at in removable(model):
        yield Reduction("terms", name, at)


def _beams(model: Model) -> Mapping[str, Any]:
    beams: Mapping[str, Any] = model.to_dict().get("beams", {})
    return beams


def _possible(model: Model, reduction: Reduction) -> bool:
    """Whether the reduced model is one: a level may not know a component, or a gauge may lose its beam's bending."""
    try:
        _ = reduction.applied(model).core
    except VpmError:
        return False
    return True

"""The XML files of an FMU: what it is, and how its sources are built."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from vpm.realtime.fmu.variables import Variable, Variables
from vpm.units import BASE_UNITS, parse_unit

#: Attributes of both kinds of FMU, which one library is for.
_ABLE = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}


def model_description(
    found: Variables, *, name: str, identifier: str, token: str, tool: str, period: float, step: float
) -> str:
    """``modelDescription.xml``, by the standard FMI 3.0.2, section 2.4.

    - ``name``, ``identifier``, ``token``, ``tool``: names of the model and of its files, the hash of all that the FMU
      computes, and what wrote it
    - ``period``, ``step``: time between communication points that the FMU suggests, and the longest of its own steps, s
    """
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=_printable(name),
        instantiationToken=token,
        generationTool=tool,
        variableNamingConvention="flat",
    )
    able = {"modelIdentifier": identifier, **_ABLE}
    ET.SubElement(root, "ModelExchange", able)
    steps = {"canHandleVariableCommunicationStepSize": "true", "fixedInternalStepSize": repr(step)}
    ET.SubElement(root, "CoSimulation", able | steps)
    _units(root, {variable.unit for variable in found.all} - {"1"})
    categories = ET.SubElement(root, "LogCategories")
    for category, says in (
        ("logStatusError", "What was wrong with a call."),
        ("logStatusDiscard", "Why a step or a value is none."),
    ):
        ET.SubElement(categories, "Category", name=category, description=says)
    ET.SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="1.0", stepSize=repr(period))
    listed = ET.SubElement(root, "ModelVariables")
    for variable in found.all:
        ET.SubElement(listed, "Float64", _attributes(variable))
    _structure(root, found)
    return _text(root)


def build_description(identifier: str, sources: Iterable[str]) -> str:
    """``buildDescription.xml``: how a shared library is made of the sources."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = ET.SubElement(build, "SourceFileSet", language="C99")
    for source in sources:
        ET.SubElement(files, "SourceFile", name=source)
    ET.SubElement(files, "PreprocessorDefinition", name="FMI3_OVERRIDE_FUNCTION_PREFIX", value="1")
    ET.SubElement(build, "Library", name="m", external="true", description="The mathematics of C.")
    return _text(root)


def _attributes(variable: Variable) -> dict[str, str]:
    varies = "tunable" if variable.causality == "parameter" else "continuous"
    words = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "causality": variable.causality,
        "variability": varies,
    }
    if variable.causality != "independent":
        words["initial"] = "calculated" if variable.start is None else "exact"
    if variable.causality == "input":
        del words["initial"]
    if variable.unit != "1":
        words["unit"] = variable.unit
    if variable.bounds is not None:
        words["min"], words["max"] = map(repr, variable.bounds)
    if variable.start is not None:
        words["start"] = repr(variable.start)
    if variable.derivative_of is not None:
        words["derivative"] = str(variable.derivative_of)
    return words


def _units(root: ET.Element, names: set[str]) -> None:
    """Units in an FMU's description with their powers of base units; fractional powers are names alone."""
    if not names:
        return
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in sorted(names):
        unit = parse_unit(name)
        powers = {**dict(zip(BASE_UNITS, unit.dimension, strict=True)), "rad": dict(unit.si_terms).get("rad", 0)}
        one = ET.SubElement(definitions, "Unit", name=name)
        if all(power.denominator == 1 for power in powers.values()):
            ET.SubElement(one, "BaseUnit", {base: str(power) for base, power in powers.items() if power})


def _structure(root: ET.Element, found: Variables) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    for what, unknowns in (("Output", found.outputs), ("ContinuousStateDerivative", found.rates)):
        for variable in unknowns:
            _dependent(structure, what, variable.reference, found.dependencies[variable.reference][0])
    # At the start the parameters are knowns too.
    for variable in (*found.outputs, *found.rates):
        own, free = found.dependencies[variable.reference]
        _dependent(structure, "InitialUnknown", variable.reference, own + free)


def _dependent(structure: ET.Element, what: str, reference: int, knowns: tuple[int, ...]) -> None:
    ET.SubElement(structure, what, valueReference=str(reference), dependencies=" ".join(map(str, knowns)))


def _printable(text: str) -> str:
    """Text in an FMU's description without what XML cannot hold."""
    return re.sub(r"[^\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)


def _text(root: ET.Element) -> str:
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"

"""Parameters of the examples from noisy simulated logs, beside the truth that the logs were simulated with."""

from identify_cases import CASES, fit_of
from validation.row import Row, row

#: Standard deviations that an estimate may be off.
REACH = 3.0


def recovered() -> list[Row]:
    """One row for each free parameter of each case."""
    rows = []
    for label, case in CASES.items():
        fit, truth = fit_of(label), case.truth
        for name, value, std, unit, (low, high) in zip(
            fit.names, fit.values, fit.std, fit.units, fit.intervals, strict=True
        ):
            source = f"the truth of the simulated log; mode {case.mode}, 95 %: {low:.5g} to {high:.5g}"
            title = f"identified {name} ({label.partition(',')[0]})"
            allowed = REACH * float(std)
            rows.append(row(title, value, truth.parameters[name].value, unit, source, absolute=allowed))
    return rows

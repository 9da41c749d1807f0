"""Discrepancy: where simulation and data disagree, and the name of what is missing."""

from vpm.discrepancy.diagnose import diagnose
from vpm.discrepancy.diagnosis import (
    AcceptedEffect,
    Ambiguity,
    ChannelGap,
    Diagnosis,
    EffectParameterEstimate,
    Empirical,
    EmpiricalTerm,
    ProposedExperiment,
    RankedCandidate,
    RefusedEffect,
    Step,
)

__all__ = [
    "AcceptedEffect",
    "Ambiguity",
    "ChannelGap",
    "Diagnosis",
    "EffectParameterEstimate",
    "Empirical",
    "EmpiricalTerm",
    "ProposedExperiment",
    "RankedCandidate",
    "RefusedEffect",
    "Step",
    "diagnose",
]

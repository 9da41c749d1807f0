"""Discrepancy: where simulation and data disagree, and the name of what is missing."""

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
from vpm.discrepancy.evidence import Evidence

__all__ = [
    "AcceptedEffect",
    "Ambiguity",
    "ChannelGap",
    "Diagnosis",
    "EffectParameterEstimate",
    "Empirical",
    "EmpiricalTerm",
    "Evidence",
    "ProposedExperiment",
    "RankedCandidate",
    "RefusedEffect",
    "Step",
]

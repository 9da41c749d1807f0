"""Diagnosis by residuals: preparation of records, the search for missing effects in sub-packages, and the result."""

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

"""Diagnosis by residuals: records are prepared, and what was named is refitted and judged."""

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

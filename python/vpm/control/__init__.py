"""The flexible model in the controller: feed-forward by stable inversion, state feedback, observer."""

from vpm.control.controller import FlexibleController
from vpm.control.feedback import StateFeedback, state_feedback
from vpm.control.feedforward import flexible_feedforward
from vpm.control.plan import FlexibleFeedforward
from vpm.control.target import TargetMotion

__all__ = [
    "FlexibleController",
    "FlexibleFeedforward",
    "StateFeedback",
    "TargetMotion",
    "flexible_feedforward",
    "state_feedback",
]

"""Models weighed by what the records say of them."""

from vpm.weighing.priors import Prior, priors_of
from vpm.weighing.weigh import Weighing, weigh

__all__ = ["Prior", "Weighing", "priors_of", "weigh"]

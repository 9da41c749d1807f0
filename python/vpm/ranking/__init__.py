"""What could be missing from a model, in the order of its evidence."""

from vpm.ranking.judgement import Judgement
from vpm.ranking.rank import rank
from vpm.ranking.result import Gap, Ranked, Ranking
from vpm.ranking.settings import Settings

__all__ = ["Gap", "Judgement", "Ranked", "Ranking", "Settings", "rank"]

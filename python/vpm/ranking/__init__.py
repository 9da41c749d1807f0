"""Ranking of effects that could be missing from a model, by observers and evidence."""

from vpm.ranking.judgement import Judgement
from vpm.ranking.rank import rank
from vpm.ranking.result import Gap, Ranked, Ranking
from vpm.ranking.settings import Settings

__all__ = ["Gap", "Judgement", "Ranked", "Ranking", "Settings", "rank"]

"""Advice before a simulation: the first half of Fig. 1 of Padmanabhan et al. 1995, with pilot runs as a check.

Every line of an ``Advice`` says what to do, and on what evidence. Every forecast names the method that made it, and is
scored against a run (``forecasts``). The evidence is linear algebra where that suffices, otherwise a short exact run,
the *pilot*.
"""

from gearrattle.advice.advice_record import Advice, Line
from gearrattle.advice.advise import advise
from gearrattle.advice.forecasts import Forecast, Score, scored

__all__ = ["Advice", "Forecast", "Line", "Score", "advise", "scored"]

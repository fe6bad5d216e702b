"""The numbers that compiled code returns are those of ``Outcome``."""

from __future__ import annotations

from gearrattle.engine.kernels import outcomes
from gearrattle.outcome import Outcome


def test_a_code_is_the_outcome_of_its_name() -> None:
    codes = {name: value for name, value in vars(outcomes).items() if name.isupper()}
    assert codes == {outcome.name: outcome.value for outcome in Outcome if outcome.name in codes}
    assert len(codes) == 9

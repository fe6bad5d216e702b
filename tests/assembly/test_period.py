from math import pi

import pytest

from gearrattle.assembly import common_period


@pytest.mark.parametrize(
    ("orders", "fundamentals", "cycles"),
    [
        ([1.0, 2.0, 5.0], 1.0, [1, 2, 5]),
        ([0.5, 1.0], 2.0, [1, 2]),
        ([2.0, 4.0], 0.5, [1, 2]),
        ([2.0, 4.0, 6.0, 21.0], 1.0, [2, 4, 6, 21]),
        ([1.0, 1.0 / 3.0, 0.75], 12.0, [4, 9, 12]),
        ([], 1.0, []),
        ([17.0 / 64.0], 64.0 / 17.0, [1]),
    ],
)
def test_the_common_period_is_one_over_the_greatest_common_divisor(
    orders: list[float], fundamentals: float, cycles: list[float]
) -> None:
    common = common_period(150.0, orders)
    assert common.period == pytest.approx(fundamentals * 2 * pi / 150.0, rel=1e-14)
    assert common.cycles.tolist() == cycles
    assert common.notes == ()


@pytest.mark.parametrize("orders", [[1.0, 2**0.5], [1.0, 1.0 + 1e-7], [1.0 / 63.0, 1.0 / 62.0]])
def test_orders_without_a_useful_common_period_count_turns_and_say_so(orders: list[float]) -> None:
    common = common_period(150.0, orders)
    assert common.period == pytest.approx(2 * pi / 150.0, rel=1e-15)
    assert common.cycles.tolist() == sorted(orders)
    assert "cycles count turns" in common.notes[0]


def test_an_order_within_1e9_of_a_fraction_counts_as_it() -> None:
    assert common_period(1.0, [1.0, 0.3333333333]).cycles.tolist() == [1.0, 3.0]

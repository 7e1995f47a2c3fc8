"""What Set Wrench Effort may ask for: throttle is a share, although the message has room for less."""

from __future__ import annotations

import pytest

from xgv_cosim.commands import WrenchEffort
from xgv_cosim.errors import CommandError


@pytest.mark.parametrize("throttle", [-0.01, -1.0, 1.01])
def test_a_negative_throttle_is_refused_and_told_what_to_use_instead_xgv_59(throttle: float) -> None:
    with pytest.raises(CommandError, match=r"expected 0 to 1; backwards is Gear\.REVERSE"):
        WrenchEffort(throttle, 0.0, 0.0)


@pytest.mark.parametrize(("name", "lower"), [("brake", "0"), ("steering", "-1")])
def test_the_other_efforts_have_no_such_hint_xgv_59(name: str, lower: str) -> None:
    efforts = {"throttle": 0.0, "brake": 0.0, "steering": 0.0, name: 1.5}
    with pytest.raises(CommandError, match=rf"{name}: got 1\.5, expected {lower} to 1$"):
        WrenchEffort(**efforts)

"""The one calculation that proves ruckig."""

from __future__ import annotations

import importlib.metadata

import pytest

from xgv_cosim.controllers import selftest
from xgv_cosim.errors import XgvCosimError


def test_ruckig_gives_the_duration_known_in_closed_form() -> None:
    assert selftest.plan_speed_gain() == importlib.metadata.version("ruckig")


def test_a_wrong_answer_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(selftest, "_ACCELERATION_MPS2", 1.0)
    with pytest.raises(XgvCosimError, match="ruckig answers"):
        selftest.plan_speed_gain()

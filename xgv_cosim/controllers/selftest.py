"""One calculation with ruckig: proves that the native library loads and answers right here."""

from __future__ import annotations

import importlib.metadata

from xgv_cosim.errors import XgvCosimError

_SPEED_GAIN_MPS = 10.0
_ACCELERATION_MPS2 = 2.0
_JERK_MPS3 = 4.0
# From rest to v with |a| <= a_max and |j| <= j_max, a_max reached: v / a_max + a_max / j_max.
_EXPECTED_S = _SPEED_GAIN_MPS / _ACCELERATION_MPS2 + _ACCELERATION_MPS2 / _JERK_MPS3


def plan_speed_gain() -> str:
    """Plan a time-optimal gain of speed and return ruckig's version.

    Raises:
        XgvCosimError: ruckig cannot be imported, or its answer is not the one known in closed form.
    """
    try:
        import ruckig  # noqa: PLC0415 - a native library, loaded where it is used
    except ImportError as error:
        raise XgvCosimError(f"ruckig cannot be imported: {error}") from error
    question = ruckig.InputParameter(1)
    question.control_interface = ruckig.ControlInterface.Velocity
    question.current_velocity = [0.0]
    question.target_velocity = [_SPEED_GAIN_MPS]
    question.max_acceleration = [_ACCELERATION_MPS2]
    question.max_jerk = [_JERK_MPS3]
    trajectory = ruckig.Trajectory(1)
    outcome = ruckig.Ruckig(1).calculate(question, trajectory)
    if outcome != ruckig.Result.Working or abs(trajectory.duration - _EXPECTED_S) > 1e-9:
        raise XgvCosimError(f"ruckig answers {outcome}, {trajectory.duration} s; right is {_EXPECTED_S} s")
    return importlib.metadata.version("ruckig")

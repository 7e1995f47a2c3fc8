"""The SafeStop's receiver: in each car one, which drives two relays (XGV-42).

The transmitter (``vehicles/transmitter.py``) sends a frame at once when its toggle or its button moves, and
one every frame period in any case. A frame carries what the transmitter asks for when it is sent, and
arrives after the latency unless it is lost. The receiver opens the relays that the last frame asks for.
When it has heard nothing for the time-out, its link supervision opens the pause relay; a dead receiver
opens both.

One transmitter serves any number of receivers; each hears or misses the same frames on its own. Sans-IO:
time is an argument. Which frames are lost follows from a key and the time of sending alone, so frames
in which nothing happens need not be looked at one by one.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from enum import IntEnum, StrEnum

from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.transmitter import RUN, Demand, Transmitter

_ROUNDING_S = 1e-9
"""Times are sums of floats; two this near are the same."""
_LOOK_AHEAD = 200
"""Frames looked at beforehand; then the receiver asks to be woken, to look on."""


class SafeStopReaction(StrEnum):
    """Which relays the receiver opens by itself."""

    PAUSE = "pause"
    """The pause relay."""
    STOP = "stop"
    """Both relays."""
    NONE = "none"
    """Neither: the relays stay as the last frame asked."""


class LinkStatus(IntEnum):
    """SafeStop link status, bits 3-4 of the safety devices (XGV-52); 3 is reserved."""

    NONE = 0
    BYPASS = 1
    GOOD = 2


class Relay(StrEnum):
    """The receiver's two relays; open asks for a stop."""

    PAUSE = "pause"
    STOP = "stop"


@dataclass(frozen=True, slots=True)
class SafeStopSettings:
    """Settings of transmitters and receivers.

    Raises:
        ScenarioError: A value is not finite or outside its range, or the time-out is not longer than
            the frame period.
    """

    frame_period_s: float = 0.05
    """Time between two frames of the transmitter."""
    latency_s: float = 0.0
    """Time from sending a frame to its arrival."""
    loss_share: float = 0.0
    """Share of frames that are lost, 0 to less than 1; drawn for each vehicle from the seed."""
    link_timeout_s: float = 0.5
    """Without a frame for this long, the link is lost."""
    link_loss: SafeStopReaction = SafeStopReaction.PAUSE
    """What the receiver does when the link is lost."""
    receiver_dead: SafeStopReaction = SafeStopReaction.STOP
    """Which relays fall open when the receiver is dead."""

    def __post_init__(self) -> None:
        problems = tuple(self._problems())
        if problems:
            raise ScenarioError("the SafeStop's settings are wrong:", problems)
        object.__setattr__(self, "link_loss", SafeStopReaction(self.link_loss))
        object.__setattr__(self, "receiver_dead", SafeStopReaction(self.receiver_dead))

    def _problems(self) -> list[str]:
        problems = []
        for name, lower, upper in (
            ("frame_period_s", 0.01, 10.0),
            ("latency_s", 0.0, 10.0),
            ("link_timeout_s", 0.01, 60.0),
        ):
            value = getattr(self, name)
            if not lower <= value <= upper:
                problems.append(f"{name}: got {value!r}, expected {lower:g} to {upper:g}")
        if not 0.0 <= self.loss_share < 1.0:
            problems.append(f"loss_share: got {self.loss_share!r}, expected 0 to less than 1")
        if self.link_timeout_s <= self.frame_period_s:
            problems.append(
                f"link_timeout_s: got {self.link_timeout_s!r}, expected more than frame_period_s "
                f"({self.frame_period_s!r}), or the link is lost between any two frames"
            )
        for name in ("link_loss", "receiver_dead"):
            value = getattr(self, name)
            if value not in list(SafeStopReaction):
                problems.append(f"{name}: got {value!r}, expected one of {', '.join(SafeStopReaction)}")
        return problems


class Receiver:
    """The receiver in one car.

    Args:
        settings: Radio and supervision.
        transmitter: The transmitter that it listens to.
        key: Names the car and the run; the frames that it misses follow from it.
        now_s: When the car is bound; the link is good then.
    """

    def __init__(self, settings: SafeStopSettings, transmitter: Transmitter, key: str, now_s: float) -> None:
        self._settings = settings
        self._transmitter = transmitter
        self._key = hashlib.sha256(key.encode()).digest()
        self._now_s = now_s
        self._examined_s = now_s - settings.latency_s
        """Frames sent up to here have arrived or are lost."""
        self._examined_moves = transmitter.num_moves(self._examined_s)
        """So are those of as many moves; several may fall on one tick."""
        self._heard_s = now_s
        self._heard = transmitter.demand_at(self._examined_s)
        self._link_up = True
        self._dead = False
        self._bypass = False
        self._stuck: dict[Relay, bool] = {}
        self._change_s = math.inf
        """The next change as last computed."""
        self._change_of: int | None = None
        """For which revision of the transmitter it was computed."""

    @property
    def is_silent(self) -> bool:
        """Return whether nothing has been heard for the time-out, bypass or not; a dead one hears nothing."""
        return self._now_s >= self._heard_s + self._settings.link_timeout_s - _ROUNDING_S

    @property
    def link(self) -> LinkStatus:
        """Return the link status that the car reports; it never changes the mode by itself (XGV-42)."""
        if self._bypass:
            return LinkStatus.BYPASS
        return LinkStatus.NONE if self.is_silent else LinkStatus.GOOD

    @property
    def heard(self) -> Demand:
        """Return what the last frame that arrived asks for."""
        return self._heard

    @property
    def missed(self) -> Demand:
        """Return what should have been heard by now, since a frame is due that asks for it (XGV-68)."""
        due, heard = self._transmitter.demand_at(self._now_s - self._settings.latency_s), self._heard
        return Demand(due.pause and not heard.pause, due.stop and not heard.stop)

    @property
    def supervision(self) -> Demand:
        """Return which relays the link supervision opens; none of them in bypass."""
        if self._bypass or self._dead or not self.is_silent:
            return RUN
        return _opened(self._settings.link_loss)

    @property
    def wanted(self) -> Demand:
        """Return which relays are driven open: by the last frame, the supervision, or for want of power."""
        parts = [self._heard, self.supervision]
        if self._dead:
            parts.append(_opened(self._settings.receiver_dead))
        return Demand(any(part.pause for part in parts), any(part.stop for part in parts))

    @property
    def relays(self) -> Demand:
        """Return which relays are open."""
        wanted = self.wanted
        return Demand(self._stuck.get(Relay.PAUSE, wanted.pause), self._stuck.get(Relay.STOP, wanted.stop))

    @property
    def next_change_s(self) -> float:
        """Return when relays or link may change by themselves, or a press is missed, ``inf`` for never."""
        revision = self._transmitter.revision
        if self._change_of != revision:
            move_s = self._transmitter.move_after(self._examined_s) + self._settings.latency_s
            self._change_s, self._change_of = min(self._look_ahead(), move_s), revision
        return self._change_s

    def advance(self, now_s: float) -> None:
        """Hear what has arrived up to ``now_s``; to be called at each ``next_change_s``."""
        settings, self._now_s, self._change_of = self._settings, now_s, None
        arrived_s = now_s - settings.latency_s
        if self._link_up and not self._dead:
            sent_s = self._transmitter.frame_before(arrived_s, settings.frame_period_s)
            while self._is_new(sent_s):
                if not self._is_lost(sent_s):
                    self._heard = self._transmitter.demand_at(sent_s)
                    self._heard_s = sent_s + settings.latency_s
                    break
                sent_s = self._transmitter.frame_before(sent_s - 10.0 * _ROUNDING_S, settings.frame_period_s)
        self._examined_s = max(self._examined_s, arrived_s)
        self._examined_moves = self._transmitter.num_moves(self._examined_s)

    def set_link(self, now_s: float, *, up: bool) -> None:
        """Let frames through from now on, or none; one that arrives at ``now_s`` is the last."""
        self.advance(now_s)
        self._link_up = up

    def set_dead(self, now_s: float, *, dead: bool) -> None:
        """Let the receiver die, or live again; it must hear a frame before its link is good."""
        self.advance(now_s)
        if dead:
            self._heard_s = -math.inf
        self._dead = dead

    def set_bypass(self, now_s: float, *, bypass: bool) -> None:
        """Switch the link supervision off or on; what frames ask for acts in any case."""
        self.advance(now_s)
        self._bypass = bypass

    def stick(self, relay: Relay, now_s: float, *, stuck: bool) -> None:
        """Let a relay stay as it is now, whatever drives it, or move again."""
        self.advance(now_s)
        if stuck:
            open_now = self.relays
            self._stuck[relay] = open_now.pause if relay is Relay.PAUSE else open_now.stop
        else:
            self._stuck.pop(relay, None)

    def is_stuck(self, relay: Relay) -> bool:
        """Return whether a relay does not move."""
        return relay in self._stuck

    def _look_ahead(self) -> float:
        """Return when the next frame tells something new, or silence becomes too long."""
        settings, transmitter = self._settings, self._transmitter
        silent, heard_s = self.is_silent, self._heard_s
        times_out_s = math.inf if silent else heard_s + settings.link_timeout_s
        sent_s = self._examined_s
        if transmitter.num_moves(sent_s) > self._examined_moves:
            return sent_s + settings.latency_s
        if self._dead or not self._link_up:
            return times_out_s
        for _ in range(_LOOK_AHEAD):
            if settings.loss_share == 0.0 and not silent and self._knows_all(sent_s):
                return math.inf
            sent_s = transmitter.frame_after(sent_s, settings.frame_period_s)
            arrives_s = sent_s + settings.latency_s
            if arrives_s > times_out_s + _ROUNDING_S:
                return times_out_s
            if self._is_lost(sent_s):
                continue
            if silent or transmitter.demand_at(sent_s) != self._heard:
                return arrives_s
            times_out_s = arrives_s + settings.link_timeout_s
        return sent_s + settings.latency_s

    def _is_new(self, sent_s: float) -> bool:
        """Return whether a frame has not been examined yet."""
        moved = self._transmitter.num_moves(sent_s) > self._examined_moves
        return moved or sent_s > self._examined_s + _ROUNDING_S

    def _knows_all(self, sent_s: float) -> bool:
        """Return whether every frame after ``sent_s`` comes and asks for what was heard last."""
        transmitter = self._transmitter
        is_steady = not transmitter.is_silent and not transmitter.has_changed_after(sent_s)
        return is_steady and self._heard == transmitter.demand

    def _is_lost(self, sent_s: float) -> bool:
        """Return whether a frame does not arrive: it was never sent, or the radio lost it."""
        if self._transmitter.is_silent_at(sent_s):
            return True
        share = self._settings.loss_share
        if share == 0.0:
            return False
        number = round(sent_s * 1e6).to_bytes(8, "big", signed=True)
        digest = hashlib.blake2b(number, digest_size=8, key=self._key).digest()
        return int.from_bytes(digest, "big") / 2**64 < share


def _opened(reaction: SafeStopReaction) -> Demand:
    return Demand(reaction is not SafeStopReaction.NONE, reaction is SafeStopReaction.STOP)

"""Events: what happened to which vehicle, when, and why. One row each in ``events.jsonl``."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened; ``docs/run-folder.md`` lists the kinds."""

    t_s: float
    """Simulation time of the control tick on which it acted (XGV-71)."""
    vehicle: str
    """Vehicle id, empty for an event of the whole run."""
    kind: str
    """What it is, for example ``safety_mode``, ``control_mode``, ``injection``, ``collision``."""
    before: str = ""
    """Value left; column ``from`` in the file."""
    after: str = ""
    """Value entered; column ``to`` in the file."""
    reasons: tuple[str, ...] = ()
    """Why, in words a person reads."""

    def as_row(self) -> dict[str, object]:
        """Return the row of ``events.jsonl``."""
        return {
            "t_s": self.t_s,
            "vehicle": self.vehicle,
            "kind": self.kind,
            "from": self.before,
            "to": self.after,
            "reasons": list(self.reasons),
        }

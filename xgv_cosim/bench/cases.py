"""Which cases are measured: those that are chosen, a quick selection, or all of the table."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.bench.extras import Extra
from xgv_cosim.bench.measuring import Case
from xgv_cosim.bench.traffic import NETWORKS, Traffic
from xgv_cosim.errors import ScenarioError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from enum import StrEnum

Number = TypeVar("Number", int, float)

QUICK_VEHICLES = (1, 100, 1000)
ALL_VEHICLES = (1, 10, 100, 1000, 5000)
PRICED_VEHICLES = 1000
"""So many vehicles have the cases of the whole table in which something else is switched on."""
SHARES = (0.1, 0.5)


class Chosen(NamedTuple):
    """What a user has chosen; empty: the default."""

    networks: Sequence[str] = ()
    couplings: Sequence[str] = ()
    vehicles: Sequence[str] = ()
    extras: Sequence[str] = ()
    shares: Sequence[str] = ()
    steps: int = 0
    steady: bool = False


def cases_of(chosen: Chosen, *, everything: bool = False) -> list[Case]:
    """Return what is to be measured.

    Args:
        chosen: Restricts or extends the default; each value may be a list with commas.
        everything: The whole table rather than the quick selection.

    Raises:
        ScenarioError: A value is no word or number that is known.
    """
    networks = _words("network", chosen.networks, NETWORKS) or list(NETWORKS)
    couplings = [CouplingKind(word) for word in _words("coupling", chosen.couplings, CouplingKind)]
    counts = [_number("vehicles", text, int) for text in _split(chosen.vehicles)]
    shares = [_number("share", text, float) for text in _split(chosen.shares)] or [1.0]
    extras = frozenset(Extra(word) for word in _words("with", chosen.extras, Extra))
    counts = counts or list(ALL_VEHICLES if everything else QUICK_VEHICLES)
    couplings = couplings or (list(CouplingKind) if everything else [CouplingKind.AUTO])
    made = [
        Case(Traffic(network, count), coupling, share, extras, steady=chosen.steady, steps=chosen.steps)
        for network, coupling, count, share in product(networks, couplings, counts, shares)
    ]
    plain = not (chosen.shares or extras or chosen.steady)
    if everything and plain:
        made += _priced(networks, couplings, chosen.steps)
    return made


def _priced(networks: Iterable[str], couplings: Sequence[CouplingKind], steps: int) -> list[Case]:
    """Return the rest of the whole table: partly bound fleets, steady targets, and each extra switched on."""
    coupling = CouplingKind.AUTO if CouplingKind.AUTO in couplings else couplings[0]
    found = []
    for network in networks:
        traffic = Traffic(network, PRICED_VEHICLES)
        found += [Case(traffic, coupling, share, steps=steps) for share in SHARES]
        found += [Case(traffic, coupling, extras=frozenset({extra}), steps=steps) for extra in Extra]
        together = frozenset({Extra.OBSERVATIONS, Extra.RECORDING, Extra.METRICS})
        found.append(Case(traffic, coupling, extras=together, steps=steps))
        if network != "grid":  # where nobody can go straight on for long
            found.append(Case(traffic, coupling, steady=True, steps=steps))
    return found


def _split(values: Sequence[str]) -> list[str]:
    """Return each item of values that may be lists with commas, in order, once."""
    items = [item.strip() for value in values for item in value.split(",")]
    return list(dict.fromkeys(items))


def _words(key: str, values: Sequence[str], known: Iterable[str] | type[StrEnum]) -> list[str]:
    names = [str(name) for name in known]
    for word in _split(values):
        if word not in names:
            raise ScenarioError(f"{key}: got {word!r}, expected {', '.join(names)}")
    return _split(values)


def _number(key: str, text: str, kind: Callable[[str], Number]) -> Number:
    try:
        return kind(text)
    except ValueError:
        raise ScenarioError(f"{key}: got {text!r}, expected a number") from None

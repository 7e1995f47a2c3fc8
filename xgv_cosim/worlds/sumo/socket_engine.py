"""SUMO over a socket, in few messages: what libsumo offers, on top of a connection of traci.

traci sends one message for each call and waits for its answer, 25 to 100 µs each, while SUMO takes any
number of commands in one message. So

* commands to vehicles are kept, and go with the next message that has to be answered;
* what was asked after the last step is asked again after this one, all at once (``look_ahead``);
* what is asked about something new (a vehicle that has just departed, the lanes of the network) is asked
  about all that is new;
* what is asked now and then about some vehicles is asked about all of them when it is asked about one.

Answers are kept until ``forget``, or until something is commanded about their subject. Callers notice
nothing of this but the time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from traci.connection import FatalTraCIError, TraCIException
from traci.domain import DOMAINS

from xgv_cosim.worlds.sumo.socket_messages import Question, SharedConnection

if TYPE_CHECKING:
    from collections.abc import Callable

    from traci.connection import Connection

STATIC = frozenset({"lane", "edge", "junction", "route", "vehicletype"})
"""Domains that are not asked again after each step."""
OF_TWO = frozenset({"getFoes"})
"""Questions about a lane and one that it leads to: of another lane they would be about nothing."""
_QUESTIONS = ("get", "is")
"""How the names of traci's getters begin; anything else is a command."""
_LONGEST_PAUSE = 15
"""What was asked about a vehicle so many steps ago at most is asked again together with the others."""

_Pattern = tuple[str, str, tuple[Any, ...]]
"""A question but for its subject: domain, getter, further arguments."""


class _Domain:
    """One of traci's domains, its getters answered by the engine's memory."""

    def __init__(self, engine: SocketEngine, name: str, real: object) -> None:
        self._engine = engine
        self._name = name
        self._real = real

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever traci has
        real = getattr(self._real, name)
        if not callable(real):
            return real
        made = self._getter(name, real) if name.startswith(_QUESTIONS) else self._command(name, real)
        setattr(self, name, made)
        return made

    def _getter(self, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        engine, domain = self._engine, self._name

        def get(*args: Any) -> Any:  # noqa: ANN401 - whatever traci takes and returns
            if args and isinstance(args[0], str):
                return engine.ask(Question(domain, name, args[0], args[1:]), real)
            return engine.ask(Question(domain, name, "", args), real)

        return get

    def _command(self, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
        concerns_one = self._name == "vehicle" and name.startswith(("set", "move", "change", "slow"))

        def command(*args: Any, **kwargs: Any) -> Any:  # noqa: ANN401 - whatever traci takes and returns
            self._engine.changes(args[0] if concerns_one and args else "")
            return real(*args, **kwargs)

        return command


class SocketEngine:
    """SUMO behind a socket. Implements ``Engine`` and ``OverSocket``.

    Args:
        scripts: The connection of traci.
    """

    TraCIException = TraCIException
    FatalTraCIError = FatalTraCIError

    vehicle: Any
    vehicletype: Any
    simulation: Any
    lane: Any
    edge: Any
    route: Any
    trafficlight: Any

    def __init__(self, scripts: Connection) -> None:
        self._connection = SharedConnection(scripts)
        self._trusts_answers = False
        self._answers: dict[str, dict[Question, Any]] = {}
        """By their subjects."""
        self._asked: dict[Question, None] = {}
        """What was asked since the last step, in its order."""
        self._asked_before: dict[Question, None] = {}
        """What was asked after the step before."""
        self._num_steps = 0
        self._outdated: dict[Question, None] = {}
        """Whose answers a command may have changed."""
        self._known: dict[str, frozenset[str]] = {}
        """Ids of each domain that has been listed."""
        self._new: dict[str, tuple[str, ...]] = {}
        """Those that were not in the list before."""
        self._asked_about_new: dict[str, dict[_Pattern, None]] = {}
        """What was last asked about what was new, in each domain."""
        self._now_and_then: dict[_Pattern, dict[str, int]] = {}
        """Subjects of what is not asked after each step, with the step after which it was asked."""
        self._commanded: dict[str, None] = {}
        """Vehicles that were commanded since SUMO's last step."""
        self._commanded_before: dict[str, None] = {}
        """Vehicles that were commanded before it, since the last but one."""
        self._missing: set[_Pattern] = set()
        """What had no answer ready since the last step."""
        for domain in DOMAINS:
            setattr(self, domain._name, _Domain(self, domain._name, getattr(self._connection, domain._name)))

    def send(self) -> None:
        """Send the commands that are kept, if there are any.

        Raises:
            TraCIException: SUMO refuses one of them.
        """
        if self._connection.keeps:
            self._connection.send()

    def look_ahead(self) -> None:
        """Ask again what was asked after the last step, in two messages; SUMO has just made another.

        The second is about vehicles, without those that the first has told to be gone: SUMO writes each
        refusal on its standard error, which is the user's terminal.
        """
        self._learn()
        again = [question for question in self._asked if question.domain not in STATIC]
        self._asked_before, self._asked = self._asked, {}
        self._num_steps += 1
        self._answers.clear()
        self._outdated.clear()
        self._missing.clear()
        self._new = {domain: subjects for domain, subjects in self._new.items() if domain in STATIC}
        self._trusts_answers = True
        about_vehicles: list[Question] = []
        about_all: list[Question] = []
        for question in again:
            is_about_one = question.domain == "vehicle" and question.subject
            (about_vehicles if is_about_one else about_all).append(question)
        self._ask_all(about_all)
        present = self._known.get("vehicle", frozenset())
        self._ask_all([question for question in about_vehicles if question.subject in present])
        self._connection.forget_all_but(again)

    def remember(self) -> None:
        """Trust answers from now on; what is asked is not asked again after the next step."""
        self._trusts_answers = True

    def forget(self) -> None:
        """Trust no answer from now on: somebody else may command SUMO."""
        self._answers.clear()
        self._outdated.clear()
        self._trusts_answers = False

    def lose(self, vehicle_id: str) -> None:
        """Ask nothing about a vehicle that somebody else has taken out of SUMO."""
        self._known["vehicle"] = self._known.get("vehicle", frozenset()) - {vehicle_id}
        self._new["vehicle"] = tuple(name for name in self._new.get("vehicle", ()) if name != vehicle_id)

    def ask(self, question: Question, real: Callable[..., Any]) -> Any:  # noqa: ANN401 - what the getter returns
        """Return the answer to a question.

        Raises:
            TraCIException: SUMO refuses it.
        """
        if not self._trusts_answers:
            return real(*question.args)
        self._asked[question] = None
        answers = self._answers.get(question.subject)
        if answers is not None and question in answers:
            return answers[question]
        together = self._together_with(question)
        if len(together) > 1:
            self._ask_all(together)
        answers = self._answers.setdefault(question.subject, {})
        if question not in answers:
            self._keep(question, real(*question.args))
        return answers[question]

    def changes(self, vehicle_id: str) -> None:
        """Note that a command changes a vehicle, or with an empty id anything."""
        if vehicle_id:
            self._commanded[vehicle_id] = None
        changed = [vehicle_id] if vehicle_id else list(self._answers)
        for subject in changed:
            self._outdated.update(dict.fromkeys(self._answers.pop(subject, ())))

    def _learn(self) -> None:
        """Note what was asked about new subjects, and what was asked only now."""
        for domain, subjects in self._new.items():
            new = frozenset(subjects)
            asked = {
                _pattern(q): None
                for q in self._asked
                if q.domain == domain and q.subject in new and q.getter not in OF_TWO
            }
            if asked:
                self._asked_about_new[domain] = asked
        for question in self._asked.keys() - self._asked_before.keys():
            if question.subject:
                self._now_and_then.setdefault(_pattern(question), {})[question.subject] = self._num_steps
        self._commanded_before, self._commanded = self._commanded, {}
        if self._num_steps % _LONGEST_PAUSE == 0:
            recent = self._num_steps - _LONGEST_PAUSE
            kept = (
                (pattern, {subject: at for subject, at in subjects.items() if at >= recent})
                for pattern, subjects in self._now_and_then.items()
            )
            self._now_and_then = {pattern: subjects for pattern, subjects in kept if subjects}

    def _together_with(self, question: Question) -> list[Question]:
        """Return a question without an answer, with the others that go into the same message."""
        pattern = _pattern(question)
        together = {question: None, **self._outdated}
        self._outdated.clear()
        new = self._new.get(question.domain, ()) if question.getter not in OF_TWO else ()
        if question.subject in new:
            for domain, getter, rest in {pattern: None, **self._asked_about_new.get(question.domain, {})}:
                together.update((Question(domain, getter, subject, rest), None) for subject in new)
        elif question.subject:
            others = dict.fromkeys(self._now_and_then.get(pattern, ()))
            commanded = self._commanded_before | self._commanded
            if pattern in self._missing and question.subject in commanded:
                others |= commanded
            known = self._known.get(question.domain, frozenset())
            together.update((question._replace(subject=other), None) for other in others if other in known)
            together.update((again, None) for again in self._asked_along(pattern) if again.subject in known)
        self._missing.add(pattern)
        return [asked for asked in together if asked not in self._answers.get(asked.subject, ())]

    def _asked_along(self, pattern: _Pattern) -> list[Question]:
        """Return what else was asked now and then about some vehicles, after the same steps as this."""
        asked_at = self._now_and_then.get(pattern, {}).items()
        return [
            Question(domain, getter, subject, rest)
            for (domain, getter, rest), others in self._now_and_then.items()
            if domain == pattern[0]
            for subject, at in asked_at
            if others.get(subject) == at
        ]

    def _ask_all(self, questions: list[Question]) -> None:
        """Ask in one message; what SUMO refuses (a vehicle has left) stays without an answer."""
        if questions:
            for question, answer in self._connection.answers_to(questions):
                self._keep(question, answer)

    def _keep(self, question: Question, answer: Any) -> None:  # noqa: ANN401 - what a getter returns
        self._answers.setdefault(question.subject, {})[question] = answer
        if question.getter == "getIDList":
            before, now = self._known.get(question.domain, frozenset()), frozenset(answer)
            self._new[question.domain] = tuple(name for name in answer if name not in before)
            self._known[question.domain] = now


def _pattern(question: Question) -> _Pattern:
    return (question.domain, question.getter, question.rest)

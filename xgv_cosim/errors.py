"""Errors of xgv_cosim. One root; each message says what, where, got, expected and what to do.

::

    XgvCosimError
    ├── ScenarioError            a scenario, option or selection is wrong          (exit code 2)
    │   └── UnknownVehicleError  a vehicle id that no binding has
    ├── CommandError             a command value outside what the vehicle accepts
    ├── WorldError               the traffic engine cannot start or go on          (exit code 3)
    │   ├── MissingLibraryError      libsumo needs system libraries that are not there
    │   └── WorldConfigurationError  the engine refuses its input files         (exit code 2)
    ├── RecordingError           the run folder cannot be written                  (exit code 3)
    │   └── FolderInUseError     it is a file, or holds something already          (exit code 2)
    └── ReplayError              a run folder cannot be replayed                   (exit code 2)
"""


class XgvCosimError(Exception):
    """Root of every error this package raises on purpose."""


class ScenarioError(XgvCosimError):
    """A scenario file, a ``--set`` option or a selection of vehicles is wrong.

    Attributes:
        problems: One line per problem, each with its place where it has one.
    """

    def __init__(self, message: str, problems: tuple[str, ...] = ()) -> None:
        super().__init__(message if not problems else "\n".join((message, *problems)))
        self.problems = problems


class UnknownVehicleError(ScenarioError):
    """A vehicle id that no binding has.

    Attributes:
        vehicle_id: The id that was asked for.
    """

    def __init__(self, vehicle_id: str, known: tuple[str, ...], hint: str = "") -> None:
        shown = ", ".join(known[:6]) + (", ..." if len(known) > 6 else "")
        text = f"no bound vehicle {vehicle_id!r}; bound now: {shown or 'none'}"
        super().__init__(f"{text} {hint}".rstrip())
        self.vehicle_id = vehicle_id


class CommandError(XgvCosimError):
    """A command value that is not a finite number, or lies outside what the vehicle accepts."""


class LinkError(XgvCosimError):
    """A link to stacks or clients cannot be opened."""


class WorldError(XgvCosimError):
    """The traffic engine cannot start, is already in use, or failed during a step."""


class MissingLibraryError(WorldError):
    """The libsumo wheel needs system libraries that this machine lacks.

    Attributes:
        libraries: File names of the missing shared libraries, as the loader names them.
    """

    def __init__(self, libraries: tuple[str, ...], remedy: str) -> None:
        missing = ", ".join(libraries)
        super().__init__(f"libsumo needs system libraries that are not installed: {missing}. {remedy}")
        self.libraries = libraries


class WorldConfigurationError(WorldError):
    """The traffic engine refuses its configuration, network or demand; the message holds its words."""


class RecordingError(XgvCosimError):
    """The run folder cannot be written: no permission, no space left, or not a folder."""


class FolderInUseError(RecordingError):
    """What was named as run folder is a file, or a folder that is not empty; nothing was changed."""


class ReplayError(XgvCosimError):
    """A run folder cannot be replayed: a file is missing, unreadable or of another schema."""

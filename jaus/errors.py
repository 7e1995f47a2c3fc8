"""Errors of jaus.

::

    JausError
    └── ProtocolError
        ├── LocalProtocolError    this side broke the rules
        └── RemoteProtocolError   the peer broke them
"""


class JausError(Exception):
    """Root of every error this package raises on purpose."""


class ProtocolError(JausError):
    """A rule of the protocol was broken."""


class LocalProtocolError(ProtocolError):
    """This side broke a rule of the protocol."""


class RemoteProtocolError(ProtocolError):
    """The peer broke a rule of the protocol."""

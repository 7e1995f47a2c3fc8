"""Errors of jaus.

::

    JausError
    ├── DecodeError               bytes that are no message
    ├── EncodeError               a message that cannot become bytes
    ├── ProtocolError
    │   ├── LocalProtocolError    this side broke the rules
    │   └── RemoteProtocolError   the peer broke them
    └── TransportError            no way for datagrams
"""


class JausError(Exception):
    """Root of every error this package raises on purpose."""


class DecodeError(JausError):
    """Bytes that are no message: cut short, too long, or of an unknown framing."""


class EncodeError(JausError):
    """A message that cannot become bytes: a value is missing, of the wrong type or out of its range."""


class ProtocolError(JausError):
    """A rule of the protocol was broken."""


class LocalProtocolError(ProtocolError):
    """This side broke a rule of the protocol."""


class RemoteProtocolError(ProtocolError):
    """The peer broke a rule of the protocol."""


class TransportError(JausError):
    """No way for datagrams can be opened here."""

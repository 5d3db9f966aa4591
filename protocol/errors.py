"""What can go wrong on the wire.

ProtocolError
 +-- FrameError          bytes that are no frame of ours: too large, truncated, not decodable
 +-- MessageError        a frame whose message breaks its type's rules (shape, range, finiteness)
 +-- UnknownTypeError    a type this version does not know: counted and dropped, not a fault
 +-- VersionError        another major version
RefusedError             nothing wrong with the bytes: the world does not take a process in
DamagedLogError          a saved observation log that cannot be read back
"""

from __future__ import annotations


class ProtocolError(Exception):
    """Base of everything a peer's bytes can be refused for."""


class FrameError(ProtocolError):
    """The bytes are no frame of this protocol."""


class MessageError(ProtocolError):
    """The frame is well formed but its message is not valid."""


class UnknownTypeError(ProtocolError):
    """The message's type is not known to this version."""


class VersionError(ProtocolError):
    """The peer speaks another major version of the protocol."""


class RefusedError(Exception):
    """The world does not take this process in; the text says why."""


class DamagedLogError(Exception):
    """A saved observation log is damaged; the text tells what to do."""

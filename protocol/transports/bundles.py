"""Bundles on the socket between the world and a member: many frames in one multipart message.

Between world (ROUTER) and member (DEALER) travel: `J` a member joins; `W` it is welcome, with its
incarnation; `N` it is refused, with the reason; `I` the bundle of an instant; `D` the member's
answer; `P` a ping; `X` the mission is over.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import msgpack

from protocol.errors import FrameError
from protocol.host import Parcel
from protocol.lockstep import FAR_END, Bundle

JOIN, WELCOME, REFUSE, INSTANT, DONE, PING, OVER = b"J", b"W", b"N", b"I", b"D", b"P", b"X"


def pack_parcels(kind: bytes, meta: Sequence[Any], parcels: Iterable[Parcel]) -> list[bytes]:
    """Return the multipart message of `kind` with `meta` data and all frames of `parcels`."""
    layout, parts = [], []
    for parcel in parcels:
        layout.append([parcel.channel, parcel.peer, len(parcel.frame)])
        parts += parcel.frame
    return [kind, msgpack.packb([list(meta), layout]), *parts]


def unpack_parcels(message: Sequence[bytes]) -> tuple[list[Any], list[Parcel]]:
    """Return meta data and parcels of a multipart message.

    Raises:
        FrameError: the message is not one of these.
    """
    try:
        meta, layout = msgpack.unpackb(message[1])
        parcels, at = [], 2
        for channel, peer, parts in layout:
            if channel not in FAR_END or not isinstance(peer, str):
                raise FrameError(f"unknown channel {channel!r}")
            if not isinstance(parts, int) or not 0 < parts <= len(message) - at:
                raise FrameError("truncated bundle")
            parcels.append(Parcel(channel, peer, list(message[at : at + parts])))
            at += parts
        return list(meta), parcels
    except FrameError:
        raise
    except Exception as error:  # hostile bytes fail in many ways
        raise FrameError(f"not a bundle: {type(error).__name__}") from None


def pack_bundle(bundle: Bundle) -> list[bytes]:
    """Return the message that carries a bundle to its member."""
    meta = [bundle.now, bundle.strike, bundle.incarnation]
    return pack_parcels(INSTANT, meta, bundle.parcels)


def unpack_bundle(member: str, message: Sequence[bytes]) -> Bundle:
    """Return the bundle in a message.

    Raises:
        FrameError: the message is no bundle.
    """
    meta, parcels = unpack_parcels(message)
    if len(meta) != 3 or not isinstance(meta[0], float) or not isinstance(meta[2], int):
        raise FrameError("bundle without its time and incarnation")
    return Bundle(member, meta[0], parcels, meta[1], meta[2])

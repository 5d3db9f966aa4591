from __future__ import annotations

import numpy as np

from expedition.traffic import traffic_part
from protocol.codec import Frame, Header
from sim_world.radio.relay import Relay, build_relay
from sim_world.radio.settings import RadioSettings
from tests.unit.rooms import room

FRAME: Frame = [b"12345", b"678"]


def relay_of(**settings: object) -> Relay:
    radio = RadioSettings.model_validate(settings)
    return build_relay(("ada", "bob"), radio, room(), np.random.default_rng(1))


def say(relay: Relay, sender: str, to: str, kind: str = "bid") -> None:
    relay.carry(sender, Header(kind, sender, to, 1, 0.0), FRAME, 0.1)


def test_a_relay_that_carried_nothing_tells_nothing() -> None:
    empty = {"bytes": {}, "bytes_links": {}, "links": {}, "aired": {}}
    assert traffic_part(relay_of()) == empty


def test_links_and_types_hold_what_happened_to_each_frame() -> None:
    relay = relay_of(capacity_bit_s=640.0, one_way=({"speaker": "ada", "listener": "bob"},))
    relay.switch_on("server")
    say(relay, "bob", "*")
    say(relay, "bob", "server", "hello")
    relay.advance(0.1, {})
    relay.due(0.1)
    told = traffic_part(relay)
    assert told["bytes"] == {"bid": {"count": 2, "bytes": 16}, "hello": {"count": 1, "bytes": 8}}
    assert told["bytes_links"] == {
        "bob>ada": {"count": 1, "bytes": 8},
        "bob>server": {"count": 2, "bytes": 16},
    }
    assert told["aired"] == {"bob": {"bid": {"count": 1, "bytes": 8}}}
    one, none = {"count": 1, "bytes": 8}, {"count": 0, "bytes": 0}
    assert told["links"]["bob>ada"] == {
        "sent": one,
        "duplicated": none,
        "delivered": none,
        "lost": one,
        "queued": none,
        "types": {"bid": {"sent": one, "lost": one}},
    }
    server = told["links"]["bob>server"]
    assert (server["sent"]["count"], server["delivered"], server["queued"]) == (2, one, one)
    assert server["types"] == {
        "bid": {"sent": one, "delivered": one},
        "hello": {"sent": one, "queued": one},
    }

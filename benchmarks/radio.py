"""How much the relay takes: `python -m benchmarks.radio [--robots N] [--instants N]`.

Robots walk at random through the shipped hospital and speak at every instant: each a short word to
the server and one to everyone, the server a longer one to each robot. Prints for a few kinds of
radio how many frames came, and what the relay took for each frame that was sent, one to everyone
counted once for each receiver.
"""

from __future__ import annotations

import argparse
import math
import time
from typing import Any

import numpy as np

from protocol.codec import Header
from protocol.messages import EVERYONE, SERVER
from sim_world.radio.relay import Relay, build_relay
from sim_world.radio.settings import RadioSettings
from sim_world.radio.shadowing import Place
from sim_world.scene import Scene
from sim_world.world_file import load_world

STEP = 0.1
SPEED = 0.5
KINDS: dict[str, dict[str, Any]] = {
    "perfect": {},
    "disc": {"model": "disc", "range_m": 20.0},
    "path_loss": {"model": "path_loss"},
    "all at once": {
        "model": "path_loss",
        "capacity_bit_s": 5e6,
        "latency_s": 0.05,
        "jitter_s": 0.2,
        "loss": 0.05,
        "duplication": 0.02,
        "reordering": 0.02,
        "partitions": ({"start_s": 10.0, "duration_s": 20.0, "groups": (("robot1",),)},),
    },
}
SHORT, LONG = [b"h" * 40, bytes(300)], [b"h" * 40, bytes(1500)]


def walks(scene: Scene, robots: int, instants: int) -> list[dict[str, Place]]:
    """Return where everybody is at each instant; walls do not stop these robots."""
    rng = np.random.default_rng(1)
    x_min, y_min, x_max, y_max = scene.extent
    at = rng.uniform((x_min, y_min), (x_max, y_max), (robots, 2))
    heading = rng.uniform(-math.pi, math.pi, robots)
    places = []
    for _ in range(instants):
        heading += rng.normal(0.0, 0.1, robots)
        at += SPEED * STEP * np.column_stack((np.cos(heading), np.sin(heading)))
        at = np.clip(at, (x_min, y_min), (x_max, y_max))
        told = {f"robot{k + 1}": (float(x), float(y)) for k, (x, y) in enumerate(at)}
        places.append({SERVER: (x_min + 1.0, y_min + 1.0), **told})
    return places


def speak(relay: Relay, names: list[str], now: float) -> None:
    """Hand the relay what everybody has to say at one instant."""
    for name in names:
        relay.carry(name, Header("heartbeat", name, SERVER, 1, now), SHORT, now)
        relay.carry(name, Header("heartbeat", name, EVERYONE, 1, now), SHORT, now)
        relay.carry(SERVER, Header("map_delta", SERVER, name, 1, now), LONG, now)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="How much the radio relay takes.")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--instants", type=int, default=600)
    chosen = parser.parse_args()
    scene = load_world("hospital", 1).scene
    scene.walls_between(0.0, 0.0, 1.0, 1.0)  # compiles
    names = [f"robot{k + 1}" for k in range(chosen.robots)]
    path = walks(scene, chosen.robots, chosen.instants)
    print(f"{chosen.robots} robots, {chosen.instants} instants, hospital")
    print(f"{'radio':12} {'frames':>8} {'delivered':>10} {'us/frame':>9} {'ms/instant':>11}")
    for kind, settings in KINDS.items():
        radio = RadioSettings.model_validate(settings)
        relay = build_relay(names, radio, scene, np.random.default_rng(1))
        begun = time.perf_counter()
        for k, places in enumerate(path, start=1):
            speak(relay, names, k * STEP)
            relay.advance(k * STEP, places)
            relay.due(k * STEP)
        took = time.perf_counter() - begun
        sent = sum(tally.count for tally in relay.ledger.sent.values())
        came = sum(tally.count for tally in relay.ledger.delivered.values())
        print(
            f"{kind:12} {sent:8} {came / sent:10.1%} {1e6 * took / sent:9.2f} "
            f"{1e3 * took / chosen.instants:11.3f}"
        )


if __name__ == "__main__":
    main()

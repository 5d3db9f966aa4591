"""What the observation log costs on the air: `python -m benchmarks.observation_log [--seeds N]`.

Four robots observe once a second, 110 to 150 bytes each; once a minute one of them, in turn,
corrects all its poses. Bytes are counted on the air, where a broadcast is sent once, and by link,
where it counts for each robot it is meant for.
"""

from __future__ import annotations

import argparse

from protocol.log.pose_coding import pack_poses
from protocol.log.settings import LogSyncSettings
from tests.unit.protocol.log.network import Links, Network

TEAM = ["robot1", "robot2", "robot3", "robot4"]
BAD = Links(loss=0.3, duplication=0.1, delay=(0.0, 0.4))
SECONDS = 300


def drive(network: Network, seconds: int) -> None:
    """Let every robot observe once a second."""
    network.checked = False
    for second in range(seconds):
        for name in TEAM:
            network.observe(name)
        if second % 60 == 59:
            network.revise(TEAM[second // 60 % len(TEAM)])
        network.run(1.0)


def size_of(network: Network) -> int:
    """Return the size of all that was written: payloads, poses, newest revisions [bytes]."""
    logs = [network.members[name].log.own for name in TEAM]
    revisions = sum(len(pack_poses(log.poses)) for log in logs if log.revision)
    return revisions + sum(log.bytes + 12 * log.count for log in logs)


def loss(seed: int) -> None:
    """Print bytes for each observation, without and with loss."""
    totals = []
    for name, links in (("no loss", Links()), ("30 % lost, 10 % doubled", BAD)):
        network = Network(TEAM, seed, links)
        drive(network, SECONDS)
        seconds = network.settle()
        count = SECONDS * len(TEAM)
        air, by_link = sum(network.air.values()), sum(network.by_link.values())
        totals.append((air, by_link))
        parts = ", ".join(f"{kind} {size / count:.1f}" for kind, size in network.air.items())
        print(
            f"seed {seed}, {name}: {air / count:.1f} bytes an observation on the air ({parts}), "
            f"{by_link / count / 3:.1f} by link; all the same {seconds:.1f} s after the last"
        )
    (air, by_link), (bad_air, bad_link) = totals
    print(f"  ratio: by link {bad_link / by_link:.2f}, on the air {bad_air / air:.2f}")


def healing(seed: int, apart: set[str], broadcast_from: int) -> None:
    """Print what it costs when a part of the team comes back, against what was missing."""
    network = Network(TEAM, seed, settings=LogSyncSettings(broadcast_from=broadcast_from))
    network.apart = [apart]
    drive(network, 150)
    network.run(20.0)
    air, by_link = sum(network.air.values()), sum(network.by_link.values())
    network.apart = []
    seconds = network.settle()
    network.run(10.0)
    air, by_link = sum(network.air.values()) - air, sum(network.by_link.values()) - by_link
    size = size_of(network)
    logs = {name: network.members[name].log.own for name in TEAM}
    lacked = sum(
        (log.bytes + 12 * log.count + len(pack_poses(log.poses)) * bool(log.revision))
        * (len(TEAM) - len(apart) if name in apart else len(apart))
        for name, log in logs.items()
    )
    print(
        f"seed {seed}, {len(TEAM) - len(apart)} and {len(apart)} meet again, for all from "
        f"{broadcast_from} on: {air / size:.3f} on the air of {size} bytes missing, "
        f"{by_link / lacked:.3f} by link of {lacked}; {seconds:.1f} s"
    )


def main() -> None:
    """Print it all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    for seed in range(parser.parse_args().seeds):
        loss(seed)
        for apart in ({"robot1", "robot2"}, {"robot4"}):
            for broadcast_from in (2, 99):
                healing(seed, apart, broadcast_from)


if __name__ == "__main__":
    main()

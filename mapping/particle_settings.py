"""How the particle filter works, over and above what all estimators have in common."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.particle_maps import WallSettings


@dataclass(frozen=True, slots=True)
class ParticleSettings:
    """How the particle filter works, over and above `SlamSettings`.

    Attributes:
        count: number of particles.
        update_distance: the particles are updated after moving this far [m]. Each update draws, and
            what is drawn adds up along a loop: many small steps would drift more than few large.
        update_turn: or after turning this much [rad].
        update_seen: or, after moving by `update_least` [m], when a smaller share than this of a
            scan's end points lies at walls of the map: what is new is easily taken for the known
            walls beside it, and holds the robot back.
        update_least: see above [m].
        anchor_seen: a scan of which at least this share lies at walls of the map is what the next
            ones are compared with the wheels from; one that the map knows less of is not.
        evidence_weight: how much of an independent witness one scan is to the particles' weights;
            scans in a row see the same walls, with the same errors.
        resample_below: particles are drawn anew when their effective number falls below this share.
        stay: the particle that counts as the best stays it, or its best descendant does, until the
            evidence of another is larger by this [nats]: a pose that jumps serves nobody.
        guesses: poses tried when a scan contradicts the map.
        walls: how their maps are kept.
        free_reach: the map drawn of the best particle shows no more than so far around it [m].
    """

    count: int = 30
    update_distance: float = 1.0
    update_turn: float = 0.8
    update_seen: float = 0.75
    update_least: float = 0.25
    anchor_seen: float = 0.9
    evidence_weight: float = 0.1
    resample_below: float = 0.5
    stay: float = 2.0
    guesses: int = 300
    walls: WallSettings = field(default_factory=WallSettings)
    free_reach: float = 20.0

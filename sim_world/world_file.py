"""Loading worlds: the shipped ones by name, others from a TOML drawing or a ROS map."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from mapping.geometry import Pose2
from sim_world import starts as placing
from sim_world.errors import WorldError
from sim_world.floor_plan import FloorPlan, solids_of
from sim_world.map_server import read_map
from sim_world.obstacles import place_obstacles
from sim_world.scene import GridScene, Scene, WallScene
from sim_world.schema import one_line
from sim_world.starts import BODY_RADIUS
from sim_world.victims import Victim, check_victims
from sim_world.walls import build_walls

WORLDS = Path(__file__).parent / "worlds"


@dataclass(frozen=True, slots=True)
class World:
    """A world, ready to run in.

    Attributes:
        name: of a shipped world, or the file's.
        scene: what is solid.
        starts: the world's own start poses, world frame; maps have none.
        description: one line.
        victims: who lies in it, world frame.
    """

    name: str
    scene: Scene
    starts: tuple[Pose2, ...]
    description: str
    victims: tuple[Victim, ...] = ()


def shipped_worlds() -> dict[str, str]:
    """Return the names of the shipped worlds and their one-line descriptions, by name."""
    plans = (read_plan(path) for path in sorted(WORLDS.glob("*.toml")))
    return {plan.name: plan.description for plan in plans}


def load_world(name_or_path: str | Path, seed: int) -> World:
    """Return a shipped world by its name, or one from a .toml drawing or a map_server .yaml.

    Args:
        name_or_path: what the user wrote.
        seed: of the random obstacles; the same seed gives the same world.

    Raises:
        WorldError: there is no such world, or its file cannot be used.
    """
    path = _find(str(name_or_path))
    if path.suffix in (".yaml", ".yml"):
        solid, geometry = read_map(path)
        return World(path.stem, GridScene(solid, geometry), (), f"map {path.name}")
    return _build(read_plan(path), path.name, seed)


def _find(name_or_path: str) -> Path:
    """Return the file meant."""
    shipped = WORLDS / f"{name_or_path}.toml"
    path = Path(name_or_path)
    if path.suffix not in (".toml", ".yaml", ".yml"):
        if shipped.parent == WORLDS and shipped.is_file():
            return shipped
        names = ", ".join(sorted(file.stem for file in WORLDS.glob("*.toml")))
        raise WorldError(
            f"there is no world '{name_or_path}'; use one of {names}, "
            "or the path of a .toml drawing or a map_server .yaml"
        )
    if not path.is_file():
        raise WorldError(f"there is no world file {name_or_path}; check the path")
    return path


def read_plan(path: Path) -> FloorPlan:
    """Return the checked content of a world file.

    Raises:
        WorldError: it cannot be read, or a key is wrong.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise WorldError(f"{path.name}: cannot be read as TOML: {error}") from error
    try:
        return FloorPlan.model_validate(content)
    except ValidationError as error:
        raise WorldError(one_line(path.name, error)) from error


def _build(plan: FloorPlan, source: str, seed: int) -> World:
    """Return the world of a drawing."""
    starts = tuple(Pose2(x, y, math.radians(degrees)) for x, y, degrees in plan.starts)
    rng = np.random.default_rng(seed)
    points = np.array([(start.x, start.y) for start in starts]).reshape(-1, 2)
    try:
        solids, bare = solids_of(plan)
        for spec in plan.obstacles:
            solids = solids + place_obstacles(spec, solids, bare, points, rng)
        scene = WallScene(build_walls(solids, bare))
        placing.check_starts(scene, starts, BODY_RADIUS)
        check_victims(scene, plan.victims)
    except WorldError as error:
        raise WorldError(f"{source}: {error}") from error
    return World(plan.name, scene, starts, plan.description, plan.victims)


def start_poses(world: World, count: int, body_radius: float = BODY_RADIUS) -> list[Pose2]:
    """Return `count` start poses in a world; see `sim_world.starts.start_poses`."""
    return placing.start_poses(world.scene, world.starts, count, body_radius)

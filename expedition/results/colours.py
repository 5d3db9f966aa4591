"""Colours of robots, tasks and cells, the same in every picture of a run.

Robots wear the colours of Okabe & Ito (2008), which people with any kind of colour blindness can
tell apart; yellow and black are left out, they vanish on white and on walls. From the seventh robot
on they repeat, with another dash pattern.
"""

from __future__ import annotations

ROBOTS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
ROBOTS_ON_DARK = ("#4aa8e0", "#ff8a3c", "#2fcf9f", "#e79cc6", "#f5b83d", "#9bd7ff")
DASHES = ("", "7 3", "2 3", "9 3 2 3")

# (light, dark) of each kind of task.
TASKS = {
    "explore": ("#3b82c4", "#5aa5e6"),
    "visit": ("#9b5fc0", "#bd8be0"),
    "wait": ("#c3cad3", "#4a5461"),
    "drive": ("#d98a1f", "#f0aa4b"),
    "pause": ("#8b95a3", "#76808d"),
}

# (light, dark) of the marks of victims.
VICTIM = ("#d1122b", "#ff6b7a")

# Grey levels of map_server images: unknown, free, occupied.
UNKNOWN_GREY, FREE_GREY, OCCUPIED_GREY = 205, 254, 0


def rgb(colour: str) -> tuple[int, int, int]:
    """Return `#rrggbb` as three bytes."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def robot_colour(index: int, dark: bool = False) -> str:
    """Return the colour of the robot with this place in the order of ids."""
    colours = ROBOTS_ON_DARK if dark else ROBOTS
    return colours[index % len(colours)]


def robot_dash(index: int) -> str:
    """Return the dash pattern of that robot, as SVG writes it; empty is a whole line."""
    return DASHES[index // len(ROBOTS) % len(DASHES)]

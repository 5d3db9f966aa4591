"""What can go wrong with a command, besides wrong use (`expedition.team.UsageError`)."""

from __future__ import annotations


class StartError(Exception):
    """A process of the team did not get as far as listening; the text says why."""


class NoServerError(Exception):
    """Nobody answers at the server's address; the text names the mend."""

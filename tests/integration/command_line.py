"""What a command said and how it ended."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    """The end of a command.

    Attributes:
        status: exit status.
        stdout: standard output.
        stderr: standard error.
    """

    status: int
    stdout: str
    stderr: str

    def wrong_use(self, why: str) -> bool:
        """Whether this was told to be wrong use, for this reason, in one line and nothing else."""
        lines = self.stderr.splitlines()
        assert self.status == 2, self
        assert self.stdout == "", self
        assert len(lines) == 1, self
        assert lines[0].startswith("expedition: "), self
        assert why in lines[0], self
        return True

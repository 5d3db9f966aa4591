"""What can be wrong with a world.

ValueError
└── WorldError   a world file, a map or a start that cannot be used; the message names the mend
"""


class WorldError(ValueError):
    """A world that cannot be used; the message is one line and says what to change."""

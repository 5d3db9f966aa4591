"""The command line."""

from __future__ import annotations

import sys

import typer

from expedition.commands import mission, operator, processes, slam, study
from expedition.errors import NoServerError, StartError
from expedition.memory import collect_seldom, keep_freed_memory
from expedition.team import UsageError
from protocol.errors import RefusedError

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Sends a team of robots into a building nobody has a map of, and brings back one map.",
)
_MISSION, _BY_HAND, _OPERATOR, _LOGS, _STUDY = (
    "Missions",
    "One process of a team each, launched by hand",
    "An operator's word to a running server",
    "Recorded logs",
    "What there is, and what it is worth",
)
# `visit robot1 -3,2`: a place may begin with a minus and is no option for that.
_ANY_NUMBER = {"ignore_unknown_options": True}

app.command(rich_help_panel=_MISSION)(mission.run)
app.command(rich_help_panel=_BY_HAND)(processes.world)
app.command(rich_help_panel=_BY_HAND)(processes.server)
app.command(rich_help_panel=_BY_HAND)(processes.agent)
app.command(rich_help_panel=_OPERATOR, context_settings=_ANY_NUMBER)(operator.visit)
app.command(rich_help_panel=_OPERATOR)(operator.pause)
app.command(rich_help_panel=_OPERATOR)(operator.resume)
app.command(rich_help_panel=_OPERATOR)(operator.drive)
app.command(rich_help_panel=_LOGS)(slam.slam)
app.command("list", rich_help_panel=_STUDY)(study.list_everything)
app.command(rich_help_panel=_STUDY)(study.experiment)


def main() -> None:
    """Run the command line; errors become one clear line and an exit status."""
    keep_freed_memory()
    collect_seldom()
    words = sys.argv[1:]
    try:
        result = app(words or ["--help"], prog_name="expedition", standalone_mode=False)
        sys.exit(result if words and isinstance(result, int) else 0 if words else 2)
    except (UsageError, StartError, NoServerError, RefusedError) as error:
        _fail(str(error), 2)
    except TimeoutError as error:
        _fail(str(error), 1)
    except OSError as error:
        _fail(str(error), 2)
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(130)
    except Exception as error:
        _fail(_wrong_use(error), 2)


def _wrong_use(error: Exception) -> str:
    """Return what was wrong with the command line, and where to look it up.

    Which library the words come from depends on typer's version, so they are known by their shape.

    Raises:
        Exception: the error itself, if it is none of wrong use.
    """
    text = getattr(error, "format_message", None)
    if text is None:
        raise error
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "expedition"
    return f"{' '.join(text().split()).rstrip('.')}; see `{command} --help`"


def _fail(text: str, status: int) -> None:
    """Print an error in one line and end."""
    print(f"expedition: {text}", file=sys.stderr)
    sys.exit(status)


if __name__ == "__main__":
    main()

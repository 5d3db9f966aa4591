"""`expedition visit`, `pause`, `resume` and `drive`: an operator's word to a running server."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated

import typer
from pydantic import ValidationError

from expedition.commands.options import Interrupt, JsonOption, print_json, tcp_endpoint
from expedition.team import UsageError
from protocol.messages import Message
from protocol.operator_messages import Answer, PauseRequest, ResumeRequest, VisitRequest

RobotArgument = Annotated[str, typer.Argument(help="the robot's name")]
ServerOption = Annotated[
    str,
    typer.Option("--server", metavar="ADDRESS:PORT", help="where the server listens"),
]
_SERVER = "tcp://127.0.0.1:5610"


def visit(
    robot: RobotArgument,
    place: Annotated[
        str, typer.Argument(metavar="X,Y", help="where to, in metres of the team's map")
    ],
    server: ServerOption = _SERVER,
    as_json: JsonOption = False,
) -> int:
    """Send a robot to a place; it goes back to exploring afterwards."""
    try:
        x, y = (float(number) for number in place.split(","))
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError
    except ValueError:
        raise UsageError(f"{place!r} is no place: write X,Y in metres, such as 3.5,-2") from None
    return _ask(server, as_json, lambda: VisitRequest(robot=robot, x_m=x, y_m=y))


def pause(robot: RobotArgument, server: ServerOption = _SERVER, as_json: JsonOption = False) -> int:
    """Halt a robot until it is resumed; the others cover for it."""
    return _ask(server, as_json, lambda: PauseRequest(robot=robot))


def resume(
    robot: RobotArgument, server: ServerOption = _SERVER, as_json: JsonOption = False
) -> int:
    """Give a robot back to the team after a pause, a visit or a drive."""
    return _ask(server, as_json, lambda: ResumeRequest(robot=robot))


def drive(
    robot: RobotArgument,
    speed: Annotated[float, typer.Option(help="along its heading, m/s")] = 0.0,
    turn_rate: Annotated[float, typer.Option(help="counter-clockwise, rad/s")] = 0.0,
    seconds: Annotated[
        float, typer.Option("--for", min=0.0, help="how long, mission seconds")
    ] = 1.0,
    server: ServerOption = _SERVER,
    as_json: JsonOption = False,
) -> int:
    """Drive a robot by hand; it then stands still until it is resumed."""
    from expedition.operator import Operator

    if not all(math.isfinite(number) for number in (speed, turn_rate, seconds)):
        raise UsageError("--speed, --turn-rate and --for must be finite numbers")
    interrupted = Interrupt()
    with Operator(tcp_endpoint(server, "--server", "127.0.0.1", 5610)) as operator:
        answer = operator.drive(robot, speed, turn_rate, seconds, lambda: not interrupted.asked)
    return _tell(answer, as_json)


def _ask(server: str, as_json: bool, request: Callable[[], Message]) -> int:
    """Send a request and show the answer; return the exit status."""
    from expedition.operator import Operator

    try:
        message = request()
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"{where}: {first['msg'].removeprefix('Value error, ')}") from None
    with Operator(tcp_endpoint(server, "--server", "127.0.0.1", 5610)) as operator:
        answer = operator.ask(message)
    return _tell(answer, as_json)


def _tell(answer: Answer, as_json: bool) -> int:
    """Show the server's answer; return the exit status."""
    if as_json:
        print_json({"accepted": answer.accepted, "text": answer.text})
    else:
        typer.echo(answer.text, err=not answer.accepted)
    return 0 if answer.accepted else 1

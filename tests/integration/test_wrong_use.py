"""Wrong use and bad input: one clear line that names the mend, status 2, nothing left running."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.integration.command_line import Outcome
from tests.integration.teams import WORLD

Cli = Callable[..., Outcome]
FREE = ("--world", "obstacle_free", "--in-process")


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--world", "atlantis"), "use one of hospital"),
        (("--world", "no/such/map.yaml"), "check the path"),
        ((*FREE, "--starts", "-50,0,0"), "nearest free place"),
        ((*FREE, "--starts", "1,2"), "x,y,deg"),
        ((*FREE, "--starts", "1,2,nan"), "not finite"),
        ((*FREE, "--strategy", "telepathy"), "choose one of"),
        ((*FREE, "--robots", "0"), "mission.robots"),
        ((*FREE, "--robots", "x"), "--robots"),
        ((*FREE, "--max-time", "-1"), "mission.max_time_s"),
        ((*FREE, "--stop-at-coverage", "2"), "world.stop_at_coverage"),
        ((*FREE, "--set", "nonsense"), "dotted.key=value"),
        ((*FREE, "--set", "robot.wings=2"), "no such setting"),
        ((*FREE, "--set", "server.silence_s=often"), "server.silence_s"),
        ((*FREE, "--set", "strategy.magic=1"), "does not take these settings"),
        ((*FREE, "--set", 'world.faults=[{at_s=1, robot="x", kind="kill"}]'), "use one of"),
        ((*FREE, "--no-such-option"), "expedition run --help"),
        (("auction", "two"), "expedition run --help"),
        (("martians",), "no team 'martians': use one of auction"),
    ],
)
def test_a_run_that_cannot_be(words: tuple[str, ...], why: str, cli: Cli, tmp_path: Path) -> None:
    assert cli("run", *words).wrong_use(why)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("this is no TOML", "not valid TOML"),
        ('[mision]\nworld = "hospital"', "mision: there is no such setting"),
        ('[mission]\nrobots = "three"', "mission.robots"),
        ('[[robots]]\nname = "a"\n[[robots]]\nname = "a"', "two robots are named 'a'"),
        ('[[robots]]\nname = "server"', "choose another"),
        ('[[robots]]\nname = "a b"', "a name is"),
    ],
)
def test_a_team_file_that_is_wrong(text: str, why: str, cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "team.toml"
    file.write_text(text)
    assert cli("run", str(file)).wrong_use(why)


@pytest.mark.parametrize("setting", ["network.server_port", "network.world_port"])
def test_a_port_that_was_asked_for_and_is_in_use(setting: str, cli: Cli, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = holder.getsockname()[1]
        words = ("--world", WORLD, "--robots", "2", "--max-time", "5", "--json")
        outcome = cli("run", *words, "--set", f"{setting}={port}", "--out", "out")
    assert outcome.wrong_use(f"cannot listen on tcp://127.0.0.1:{port}")
    assert "another port" in outcome.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_usual_port_that_is_in_use_is_no_hindrance(cli: Cli, tmp_path: Path) -> None:
    """And with --json standard output holds one JSON value, standard error nothing to fear."""
    with socket.socket() as holder:
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            holder.bind(("127.0.0.1", 5610))
            holder.listen()
        except OSError:
            pass  # somebody else holds it, which will do
        words = ("--world", WORLD, "--robots", "2", "--max-time", "2", "--out", "out")
        outcome = cli("run", *words)
    assert outcome.status == 0
    assert "as tcp://127.0.0.1:5610 is in use" in outcome.stderr
    assert (tmp_path / "out" / "report.html").exists()


def test_json_is_one_value_and_nothing_else(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("run", *FREE, "--robots", "1", "--max-time", "2", "--json", "--out", "out")
    assert outcome.status == 0
    assert json.loads(outcome.stdout) == json.loads((tmp_path / "out/summary.json").read_text())
    listed = cli("list", "--json")
    assert set(json.loads(listed.stdout)) >= {"teams", "worlds", "strategies", "experiments"}
    assert (outcome.stderr, listed.stderr) == ("", "")


def test_a_folder_that_cannot_be_written(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    outcome = cli("run", *FREE, "--max-time", "2", "--json", "--out", "file/out")
    assert outcome.wrong_use("cannot write results in file/out")
    assert "--out" in outcome.stderr


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("world", "--bind", "here"), "--bind 'here': write it as address:port"),
        (("world", "--bind", "127.0.0.1:99999"), "address:port"),
        (("world", "--world", "atlantis"), "use one of"),
        (("server", "--world-endpoint", "x"), "--world-endpoint"),
        (("server", "--strategy", "telepathy"), "choose one of"),
        (("agent", "robot9"), "use robot1, robot2, robot3"),
        (("agent",), "expedition agent --help"),
        (("experiment", "perpetual_motion"), "use one of "),
        (("experiment", "auction-overlap", "--seeds", "0"), "--seeds"),
        (("dance",), "expedition --help"),
    ],
)
def test_other_commands_that_cannot_be(words: tuple[str, ...], why: str, cli: Cli) -> None:
    assert cli(*words).wrong_use(why)


@pytest.mark.parametrize("command", ["world", "server"])
def test_a_port_in_use_by_hand(command: str, cli: Cli) -> None:
    with socket.create_server(("127.0.0.1", 0)) as holder:
        port = holder.getsockname()[1]
        outcome = cli(command, "--bind", f"127.0.0.1:{port}", "--out", "out")
    assert outcome.wrong_use("cannot listen on")


@pytest.mark.parametrize(
    "command",
    ["run", "world", "server", "agent", "visit", "pause", "resume", "drive", "list", "experiment"],
)
def test_every_command_has_help(command: str, cli: Cli) -> None:
    outcome = cli(command, "--help")
    assert outcome.status == 0
    assert f"Usage: expedition {command}" in outcome.stdout
    assert outcome.stderr == ""


def test_without_a_command_there_is_help_too(cli: Cli) -> None:
    outcome = cli()
    assert outcome.status == 2
    assert "experiment" in outcome.stdout

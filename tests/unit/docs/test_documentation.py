"""What the documents say exists, exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer.main

from docs.generate_settings import PAGE, page
from expedition.cli import app

ROOT = Path(__file__).parent.parent.parent.parent
DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
PACKAGES = (
    "mapping", "coordination", "protocol", "server", "robot_agent", "sim_world", "expedition",
    "teams", "tests", "docs", "benchmarks",
)  # fmt: skip

_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`\n]+)`")
_FILE = re.compile(rf"(?:{'|'.join(PACKAGES)})/[\w./-]*\w\.\w+$")


def _anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as code hosts make them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(document: Path) -> None:
    dead = []
    for target in _LINK.findall(document.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        there = (document.parent / path).resolve() if path else document
        if not there.exists() or (anchor and anchor not in _anchors(there)):
            dead.append(target)
    assert dead == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_file_named_exists(document: Path) -> None:
    named = _CODE.findall(document.read_text(encoding="utf-8"))
    files = [name for name in named if _FILE.match(name) and "NAME" not in name]
    assert [name for name in files if not (ROOT / name).exists()] == []


def test_the_table_of_commands_is_whole() -> None:
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("## Commands")[1]
    table = re.findall(r"^\| `(\w+)` \|", section.split("\n## ")[0], re.MULTILINE)
    assert sorted(table) == sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]


def test_the_page_of_settings_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run `make docs`"


def test_every_decision_is_listed() -> None:
    folder = ROOT / "docs" / "decisions"
    listed = set(_LINK.findall((folder / "README.md").read_text(encoding="utf-8")))
    assert listed == {path.name for path in folder.glob("0*.md")}

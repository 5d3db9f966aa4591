"""Writes docs/settings.md from the models that check a team file: `make docs`."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel, TypeAdapter
from pydantic.fields import FieldInfo

from coordination.strategy import STRATEGIES, load_strategy
from expedition.team import TeamSettings

PAGE = Path(__file__).parent / "settings.md"
_HEAD = """\
# Settings

Every key of a team file, with its default. Units are part of the names. Any of them can also be set
on the command line: `--set server.executive.lease_s=30`; lists and tables are written as in TOML.
An unknown key or a value out of range is refused with one line that names it.

This page is made from the models in the code by `make docs`; a test keeps it current.
"""
_WORDS = {
    "number": "number",
    "integer": "whole number",
    "string": "text",
    "boolean": "true or false",
    "array": "list",
    "object": "table",
}
_LIMITS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def page() -> str:
    """Return the whole page."""
    parts = [_HEAD]
    for title, model in _models("", TeamSettings):
        parts.append(_section(title or "At the top", model, title))
        if title == "mission":
            parts += [_strategy_section(name) for name in STRATEGIES]
    return "\n".join(filter(None, parts))


def _strategy_section(name: str) -> str:
    """Return the section on a strategy's own settings."""
    settings: Any = getattr(load_strategy(name), "settings", None)
    title = f"strategy, when `mission.strategy` is `{name}`"
    if not isinstance(settings, BaseModel):
        return f"## {title}\n\nNothing to set.\n"
    return _section(title, type(settings), "strategy")


def _models(prefix: str, model: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield a model and all models within it, each with its dotted key."""
    yield prefix, model
    for key, field in model.model_fields.items():
        inner = _inner(field)
        if inner is not None:
            dotted = f"{prefix}.{key}" if prefix else key
            yield from _models(dotted if inner[1] else f"{dotted}[]", inner[0])


def _inner(field: FieldInfo) -> tuple[type[BaseModel], bool] | None:
    """Return the model a field holds and whether it holds one (else a list of them), or None."""
    kind = field.annotation
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind, True
    for part in getattr(kind, "__args__", ()):
        if isinstance(part, type) and issubclass(part, BaseModel):
            return part, False
    return None


def _section(title: str, model: type[BaseModel], prefix: str) -> str:
    """Return the section on one model: what its docstring says, then a table of its keys."""
    if prefix.endswith("robots[].body"):
        return f"## {title}\n\nThe keys of `body`, for this robot alone; the rest is inherited.\n"
    if prefix.startswith("robots[].body."):
        return ""
    prose, meanings = _documented(model)
    lines = [f"## {title}", "", *prose]
    rows = [
        _row(f"{prefix}.{key}" if prefix else key, key, field, meanings)
        for key, field in model.model_fields.items()
        if _inner(field) is None
    ]
    if rows and meanings:
        lines += ["", "| key | default | may be | what it is |", "|---|---|---|---|", *rows]
    elif rows:
        lines += ["", "| key | default | may be |", "|---|---|---|", *rows]
    return "\n".join(lines) + "\n"


def _row(dotted: str, key: str, field: FieldInfo, meanings: dict[str, str]) -> str:
    """Return one row of a table."""
    cells = [f"`{dotted}`", _default(field), _kind(field)]
    if meanings:
        cells.append(meanings.get(key, ""))
    return f"| {' | '.join(cells)} |"


def _default(field: FieldInfo) -> str:
    """Return how the default is written in TOML."""
    if field.is_required():
        return "must be given"
    value = field.get_default(call_default_factory=False)
    if value is None:
        return "not set"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, tuple | dict):
        return "empty" if not value else f"`{value}`"
    return f'`"{value}"`' if isinstance(value, str) else f"`{value}`"


def _kind(field: FieldInfo) -> str:
    """Return what a value may be, with its limits."""
    adapter: TypeAdapter[Any] = TypeAdapter(field.rebuild_annotation())
    schema = adapter.json_schema()
    options = [option for option in schema.get("anyOf", [schema]) if option.get("type") != "null"]
    return " or ".join(dict.fromkeys(_kind_of(option) for option in options))


def _kind_of(schema: dict[str, Any]) -> str:
    """Return one kind of value in words."""
    if "enum" in schema:
        return ", ".join(f"`{choice}`" for choice in schema["enum"])
    if "const" in schema:
        return f"`{schema['const']}`"
    names = {
        "number": "number",
        "integer": "whole number",
        "string": "text",
        "boolean": "yes or no",
    }
    words = names.get(schema.get("type", ""), schema.get("type", "any"))
    words = {"array": "list", "object": "table"}.get(words, words)
    limits = [f"{sign} {schema[key]:g}" for key, sign in _LIMITS.items() if key in schema]
    return f"{words} {' and '.join(limits)}".replace("<", "&lt;").replace(">", "&gt;").strip()


def _documented(model: type[BaseModel]) -> tuple[list[str], dict[str, str]]:
    """Return the prose of a model's docstring, and what it says about single keys."""
    text = inspect.cleandoc(model.__doc__ or "")
    before, _, attributes = text.partition("Attributes:\n")
    meanings = {
        match[1]: " ".join(match[2].split())
        for match in re.finditer(r"^    (\w+): (.*(?:\n {8}.*)*)", attributes, re.MULTILINE)
    }
    return before.strip().splitlines(), meanings


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

import pytest
from pydantic import BaseModel, ConfigDict, ValidationError

from sim_world.schema import one_line


class _Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    size: float = 1.0


class _Outer(BaseModel):
    name: str
    parts: list[_Inner] = []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ({}, "w.toml: 'name' is missing; add it"),
        (
            {"name": "a", "parts": [{"sise": 2}]},
            "w.toml: unknown key 'parts[0].sise'; remove it or correct its spelling",
        ),
        (
            {"name": "a", "parts": [{"size": "x" * 99}, {"size": "y"}]},
            "w.toml: 'parts[0].size' is '" + "x" * 56 + "...: input should be a valid number, "
            "unable to parse string as a number (and 1 more)",
        ),
    ],
)
def test_one_line(content, says):
    with pytest.raises(ValidationError) as caught:
        _Outer.model_validate(content)
    assert one_line("w.toml", caught.value) == says

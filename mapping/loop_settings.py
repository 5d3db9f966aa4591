"""What a user may set about how pieces of a map are tied to each other."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

_NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class LoopSettings(BaseModel):
    """How pieces of the map are tied to each other, see `submap_graph`.

    Attributes:
        submap_range_m: what is farther away than this is not drawn in submaps; it costs memory.
        submap_m: a submap reaches this far from its anchor,
        submap_scans: holds this many scans,
        submap_sigma_m: and ends when the way since its anchor is less sure than this,
        submap_sigma_deg: or this.
        spans_m: of pieces of way this long a robot's own map is believed as a whole, see `trail`.
        enough: a submap is not kept when there are so many others whose anchors lie within
        enough_within_m: of its own.
        points: a scan must have this many end points at a submap's walls,
        fit_least: and this share of those that fall where the submap is known.
        fit_at_once: with a smaller share it is looked for in the whole window.
        compared: with so many submaps a scan is compared, those it overlaps most.
        again_m: and with each of them again after moving this far.
        again_most: at the end so many scans are compared with all submaps around them,
        firm: but for those to which so many comparisons tie theirs already.
        search_from_m: a smaller window is not worth a search.
        window_m: largest window,
        window_deg: and turn.
        gate: squared distance from what is expected, in standard deviations, beyond which a match
            is not believed (three dimensions).
        settle_above: the map is put right when a loop closes with a larger squared error,
        settle_every: or after so many closed loops,
        settle_share: or this share of all closed so far, if that is more.
        reject_above: at the end a comparison with a larger squared error is taken out of the graph.
        redraw_m: the map is drawn again when a scan has moved this far,
        redraw_deg: or turned this much.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    submap_range_m: _Positive = 12.0
    submap_m: _Positive = 5.0
    submap_scans: Annotated[int, Field(ge=2)] = 30
    submap_sigma_m: _Positive = 0.06
    submap_sigma_deg: _Positive = 1.0
    spans_m: tuple[_Positive, ...] = (4.0, 16.0)
    enough: Annotated[int, Field(ge=1)] = 4
    enough_within_m: _NotNegative = 2.0
    points: Annotated[int, Field(ge=3)] = 12
    fit_least: float = 0.75
    fit_at_once: float = 0.8
    compared: Annotated[int, Field(ge=0)] = 3
    again_m: _Positive = 0.5
    again_most: Annotated[int, Field(ge=1)] = 100
    firm: Annotated[int, Field(ge=1)] = 4
    search_from_m: _Positive = 0.1
    window_m: _Positive = 2.0
    window_deg: _Positive = 20.0
    gate: _Positive = 16.0
    settle_above: _Positive = 12.0
    settle_every: Annotated[int, Field(ge=1)] = 12
    settle_share: _NotNegative = 0.3
    reject_above: _Positive = 30.0
    redraw_m: _Positive = 0.08
    redraw_deg: _Positive = 0.7

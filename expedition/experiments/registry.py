"""The experiments that `expedition experiment` knows: name -> "module:function"."""

from __future__ import annotations

EXPERIMENTS: dict[str, str] = {
    "auction_overlap": "expedition.experiments.auction_overlap:run",
}

"""The experiments that `expedition experiment` knows: name -> "module:function"."""

from __future__ import annotations

EXPERIMENTS: dict[str, str] = {
    "auction-environments": "expedition.experiments.auction_environments:run",
    "auction-hospital": "expedition.experiments.auction_hospital:run",
    "auction-overlap": "expedition.experiments.auction_overlap:run",
    "rescue-bandwidth": "expedition.experiments.rescue_bandwidth:run",
    "rescue-links": "expedition.experiments.rescue_links:run",
    "rescue-maps": "expedition.experiments.rescue_maps:run",
    "slam-logs": "expedition.experiments.slam_logs:run",
    "slam-teams": "expedition.experiments.slam_teams:run",
}

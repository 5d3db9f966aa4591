"""How likely a scan is, given the map so far: the perceptual model P(o | s, m).

"It is unlikely to receive sensor readings where previous scans saw free space." For one end point p
whose closest wall is the surfel (m, A):

    log p(p) = log e + t log((1 - e) exp(-(p - m)' A (p - m) / (2 sigma^2)) / e + 1)

A is n n' on a straight wall, so only the distance to the wall's line counts, and the identity at a
lone post. The trust t in the surfel is below one while only few scans have seen it: those share the
errors of their poses, and the new must not drag the old along. Far from all walls the value is flat
at log e: teammates, moved things and rooms never seen do not pull. The function is differentiable
in the pose; gradient and Hessian are analytic.

Source: Simmons et al. 2000, section "Coordinated Mapping", Figure 2; the outlier mixture follows
Thrun, Burgard & Fox 2005, section 6.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mapping.compiled import compiled
from mapping.geometry import Floats, Pose2
from mapping.grid import GridGeometry
from mapping.surface_map import SurfaceMap, layer_of

# An end point this far behind a wall [m] contradicts the map ...
BEHIND = 0.4
# ... when the wall's log-odds are above this: seen by several scans.
BLOCKING = 2.0


@dataclass(frozen=True, slots=True)
class PerceptionSettings:
    """Shape of the likelihood of one end point.

    Attributes:
        sigma: how far end points scatter about the mapped wall [m]: range noise and map error.
        outlier: weight e of end points that no known wall explains.
        beam_weight: how much of an independent witness one beam is. Neighbouring beams share the
            map's errors; with 1 the covariances would come out far too small.
    """

    sigma: float = 0.03
    outlier: float = 0.05
    beam_weight: float = 1.0


@dataclass(frozen=True, slots=True)
class ScanLikelihood:
    """Log-likelihood of a scan at one pose, up to a constant, with its derivatives.

    Attributes:
        value: sum over end points, weighted by `beam_weight`.
        gradient: (3,) in (x, y, theta) of the pose, map frame.
        hessian: (3, 3).
    """

    value: float
    gradient: Floats
    hessian: Floats


def scan_likelihood(
    surfaces: SurfaceMap,
    geometry: GridGeometry,
    points_base: Floats,
    T_map_base: Pose2,
    settings: PerceptionSettings,
) -> ScanLikelihood:
    """Return the log-likelihood of end points at a pose.

    Args:
        surfaces: the walls seen so far.
        geometry: of the grid that `surfaces` follows.
        points_base: (N, 4) end points of the beams that hit [m] and the directions their
            surfaces face, see `scan_points`.
        T_map_base: the pose to judge.
        settings: shape of the likelihood.
    """
    derivatives = np.zeros(9)
    value = accumulate_likelihood(
        points_base,
        (T_map_base.x, T_map_base.y, T_map_base.theta),
        surfaces.closest,
        surfaces.surfels,
        (geometry.origin_x, geometry.origin_y, geometry.resolution),
        settings.sigma,
        settings.outlier,
        derivatives,
    )
    d = settings.beam_weight * derivatives
    hessian = np.array([[d[3], d[4], d[5]], [d[4], d[6], d[7]], [d[5], d[7], d[8]]])
    return ScanLikelihood(settings.beam_weight * value, d[:3], hessian)


@compiled
def accumulate_likelihood(
    points: Floats,
    pose: tuple[float, float, float],
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
    sigma: float,
    outlier: float,
    derivatives: Floats,
) -> float:
    """Sum log-likelihoods; leave gradient (3) and Hessian (6) in `derivatives`.

    Packed order: g_x g_y g_t, h_xx h_xy h_xt h_yy h_yt h_tt.
    """
    _, rows, cols = closest.shape
    px, py, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    origin_x, origin_y, resolution = lattice
    per_cell = 1.0 / resolution
    inverse = 1.0 / (sigma * sigma)
    flat = math.log(outlier)
    value = gx = gy = gt = hxx = hxy = hxt = hyy = hyt = htt = 0.0
    for i in range(points.shape[0]):
        rx = c * points[i, 0] - s * points[i, 1]
        ry = s * points[i, 0] + c * points[i, 1]
        x, y = px + rx, py + ry
        fx = (x - origin_x) * per_cell
        fy = (y - origin_y) * per_cell
        if not (0.0 <= fx < cols and 0.0 <= fy < rows):
            value += flat
            continue
        k = closest[
            layer_of(c * points[i, 2] - s * points[i, 3], s * points[i, 2] + c * points[i, 3]),
            int(fy),
            int(fx),
        ]
        if k < 0:
            value += flat
            continue
        ex, ey = x - surfels[k, 0], y - surfels[k, 1]
        axx, axy, ayy = surfels[k, 2], surfels[k, 3], surfels[k, 4]
        # u = A e is half the gradient of the squared distance by (x, y).
        ux, uy = axx * ex + axy * ey, axy * ex + ayy * ey
        near = (1.0 - outlier) * math.exp(-0.5 * inverse * (ex * ux + ey * uy))
        density = near + outlier
        trust = surfels[k, 5]
        value += flat + trust * (math.log(density) - flat)
        share = near / density
        pull = trust * share * inverse
        bend = pull * inverse * (1.0 - share)
        # Derivative of the end point by theta is (-ry, rx), the second one (-rx, -ry).
        ut = -ry * ux + rx * uy
        axt, ayt = -ry * axx + rx * axy, -ry * axy + rx * ayy
        gx -= pull * ux
        gy -= pull * uy
        gt -= pull * ut
        hxx += bend * ux * ux - pull * axx
        hxy += bend * ux * uy - pull * axy
        hyy += bend * uy * uy - pull * ayy
        hxt += bend * ux * ut - pull * axt
        hyt += bend * uy * ut - pull * ayt
        htt += bend * ut * ut - pull * (-ry * axt + rx * ayt - rx * ux - ry * uy)
    derivatives[0], derivatives[1], derivatives[2] = gx, gy, gt
    derivatives[3], derivatives[4], derivatives[5] = hxx, hxy, hxt
    derivatives[6], derivatives[7], derivatives[8] = hyy, hyt, htt
    return value


@compiled
def accumulate_information(
    points: Floats,
    pose: tuple[float, float, float],
    laser: tuple[float, float],
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    log_odds: npt.NDArray[np.float32],
    lattice: tuple[float, float, float],
    sigma: float,
    outlier: float,
    known_above: float,
    information: Floats,
) -> tuple[int, int]:
    """Sum the information of the end points that walls explain; count known and explained ones.

    The information is the part of the negative Hessian that can never be negative (Gauss-Newton),
    so a scan that says nothing of a direction adds nothing there, exactly.

    Args:
        laser: where the beams start (x, y) [m], base frame; not a number if not known.
        known_above: a cell is known where the log-odds exceed this in size.
        information: (3, 3), filled here.

    Returns:
        Number of end points about which the map has an opinion (at a wall, in a known cell, or
        behind a wall), and how many of these lie within 3 sigma of a wall.
    """
    _, rows, cols = closest.shape
    px, py, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    origin_x, origin_y, resolution = lattice
    laser_x = (px + c * laser[0] - s * laser[1] - origin_x) / resolution
    laser_y = (py + s * laser[0] + c * laser[1] - origin_y) / resolution
    inverse = 1.0 / (sigma * sigma)
    known = explained = 0
    information[:] = 0.0
    for i in range(points.shape[0]):
        rx = c * points[i, 0] - s * points[i, 1]
        ry = s * points[i, 0] + c * points[i, 1]
        fx = (px + rx - origin_x) / resolution
        fy = (py + ry - origin_y) / resolution
        inside = 0.0 <= fx < cols and 0.0 <= fy < rows
        layer = layer_of(c * points[i, 2] - s * points[i, 3], s * points[i, 2] + c * points[i, 3])
        k = closest[layer, int(fy), int(fx)] if inside else -1
        q = math.inf
        if k >= 0:
            ex, ey = px + rx - surfels[k, 0], py + ry - surfels[k, 1]
            axx, axy, ayy = surfels[k, 2], surfels[k, 3], surfels[k, 4]
            q = inverse * (axx * ex * ex + 2.0 * axy * ex * ey + ayy * ey * ey)
        if q < 9.0:
            known += 1
            explained += 1
            near = (1.0 - outlier) * math.exp(-0.5 * q)
            pull = surfels[k, 5] * near / (near + outlier) * inverse
            axt, ayt = -ry * axx + rx * axy, -ry * axy + rx * ayy
            information[0, 0] += pull * axx
            information[0, 1] += pull * axy
            information[0, 2] += pull * axt
            information[1, 1] += pull * ayy
            information[1, 2] += pull * ayt
            information[2, 2] += pull * (-ry * axt + rx * ayt)
        elif (inside and abs(log_odds[int(fy), int(fx)]) > known_above) or (
            not math.isnan(laser_x)
            and _blocked(log_odds, laser_x, laser_y, fx, fy, BEHIND / resolution)
        ):
            known += 1
    information[1, 0] = information[0, 1]
    information[2, 0] = information[0, 2]
    information[2, 1] = information[1, 2]
    return known, explained


@compiled
def _blocked(
    log_odds: npt.NDArray[np.float32], x0: float, y0: float, x1: float, y1: float, margin: float
) -> bool:
    """Whether a well known wall stands between two points, more than a margin before the second.

    Coordinates and margin are in cells; the way is probed once per cell length.
    """
    rows, cols = log_odds.shape
    dx, dy = x1 - x0, y1 - y0
    length = math.sqrt(dx * dx + dy * dy)
    for step in range(1, int(length - margin)):
        fx, fy = x0 + dx * step / length, y0 + dy * step / length
        if 0.0 <= fx < cols and 0.0 <= fy < rows and log_odds[int(fy), int(fx)] > BLOCKING:
            return True
    return False


@compiled
def best_trust(
    points: Floats,
    pose: tuple[float, float, float],
    closest: npt.NDArray[np.int32],
    surfels: Floats,
    lattice: tuple[float, float, float],
) -> float:
    """Return the most trusted among the walls around the end points; 1 if there is none.

    Weights count by comparison: where all walls in view are young, they are all there is to go by.
    """
    _, rows, cols = closest.shape
    px, py, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    best = 0.0
    for i in range(points.shape[0]):
        fx = (px + c * points[i, 0] - s * points[i, 1] - lattice[0]) / lattice[2]
        fy = (py + s * points[i, 0] + c * points[i, 1] - lattice[1]) / lattice[2]
        if 0.0 <= fx < cols and 0.0 <= fy < rows:
            layer = layer_of(
                c * points[i, 2] - s * points[i, 3], s * points[i, 2] + c * points[i, 3]
            )
            k = closest[layer, int(fy), int(fx)]
            if k >= 0:
                best = max(best, surfels[k, 5])
    return best if best > 0.0 else 1.0

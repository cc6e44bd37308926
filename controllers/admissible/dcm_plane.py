"""Tracking sets of DCM gains: everything happens in the plane of the DCM, where the error shrinks by one factor."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from controllers.admissible.moa import MoaSet
from controllers.admissible.recursion import Rows
from controllers.gains import dcm_contraction
from controllers.geometry.support_polygon import SupportPolygon
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference

# Natural logarithm of the largest power of the contraction used at once: 1e200, clear of overflow.
_POWERS = 460.0


def in_dcm_plane(pendulum: Pendulum, reference: Reference, terminal: MoaSet, ratio: float, final_ratio: float) -> Rows:
    """One row a phase for each direction an edge faces: that of the sample which limits the DCM error most.

    The DCM error shrinks by lambda a sample, so the edge at sample l asks of the error at phase k that
    normal . error <= margin_l / (weight_l lambda^(l - k)), and only the least of these over l >= k counts.
    Errors of the ZMP up to h along the normal take h of the margin at once (of the terminal set's it is gone
    already) and h weight_l (1 - lambda^(l - k)) / (k - 1) by then. Written over the same denominator, that is a
    smaller margin and a constant, which leaves open nothing but the same minimum.
    """
    m = reference.m
    normals, margin, edges = _margins(reference, terminal)
    directions, phase = len(normals), np.arange(m + 1)
    weight = np.full(m + 1, ratio)
    weight[m] = final_ratio
    contraction = dcm_contraction(pendulum, ratio)
    late = np.zeros(directions)
    if terminal.error is not None:
        off = terminal.error.support(normals)
        margin[:-1] -= off
        late = off / (ratio - 1.0)
    limiting = limiting_samples(margin / weight[:, None] - late, contraction)
    scale = weight[limiting] * (contraction**phase)[limiting - phase[:, None]]
    seen = np.repeat(normals, 2, axis=1) / np.array([1.0, pendulum.omega, 1.0, pendulum.omega])
    entry = limiting * directions + np.arange(directions)
    a = margin.ravel()[entry] - (weight[limiting] - scale) * late + scale * (reference.xi @ seen.T)
    S = (scale[:, :, None] * seen).reshape(-1, 4)
    edge = edges[np.append(reference.support_of, len(edges) - 1)].ravel()[entry]
    return S, a.ravel(), np.arange(m + 2) * directions, limiting.ravel(), edge.ravel()


def _margins(reference: Reference, terminal: MoaSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions that edges face, and the margin of the reference towards each of them.

    Returns:
        normals (D, 2); margins (m + 1, D) [m] of samples 0..m, inf where no edge faces there; and edges
        (P + 1, D), the edge of each support that faces there or -1, the terminal polygon last.
    """
    polygons = (*reference.supports, terminal.polygon)
    normals, edges = directions_of(polygons)
    offsets = np.full((len(polygons), len(normals)), np.inf)
    for i, polygon in enumerate(polygons):
        facing = edges[i] >= 0
        offsets[i, facing] = polygon.v[edges[i, facing]]
    margin = np.full((reference.m + 1, len(normals)), np.inf)
    margin[:-1] = offsets[reference.support_of] - reference.mu @ normals.T
    # The terminal set is its polygon times its ratio, shifted from its centre to the end of the reference.
    facing = edges[-1] >= 0
    at_end = terminal.a - terminal.S @ (reference.xi[-1] - terminal.x_C)
    margin[-1, facing] = at_end[edges[-1, facing]]
    return normals, margin, edges


def directions_of(polygons: Sequence[SupportPolygon]) -> tuple[np.ndarray, np.ndarray]:
    """Directions (D, 2) that edges face, and the edge (P, D) of each polygon that faces there, or -1."""
    known: dict[tuple[float, float, int], int] = {}
    columns: list[list[int]] = []
    for polygon in polygons:
        own: list[int] = []
        for nx, ny in np.round(polygon.M, 12).tolist():
            # Feet with the same heading share their directions, but a polygon with two edges this close to
            # parallel keeps both.
            key = (nx, ny, 0) if known.get((nx, ny, 0)) not in own else (nx, ny, len(known))
            own.append(known.setdefault(key, len(known)))
        columns.append(own)
    normals = np.empty((len(known), 2))
    edges = np.full((len(polygons), len(known)), -1)
    for i, (polygon, own) in enumerate(zip(polygons, columns, strict=True)):
        normals[own], edges[i, own] = polygon.M, np.arange(len(own))
    return normals, edges


def limiting_samples(least: np.ndarray, contraction: float) -> np.ndarray:
    """The l >= k of the least least[l] / contraction^(l - k), for all k: (m + 1, D) from (m + 1, D)."""
    limiting = np.empty(least.shape, dtype=np.intp)
    limiting[-1] = len(least) - 1
    least = least.copy()
    # Blocks so short that the powers stay within double precision; one block for any usual gain.
    block = max(1, int(_POWERS / -math.log(contraction)))
    stop = len(least) - 1
    while stop > 0:
        first = max(0, stop - block)
        seen = least[first : stop + 1] * (contraction ** -np.arange(stop - first + 1.0))[:, None]
        until_end = np.minimum.accumulate(seen[::-1], axis=0)[::-1]
        own = np.arange(first, stop + 1)[:, None]
        # Where a later sample limits more, the first one from there on that is itself the least.
        candidate = np.where(seen == until_end, own, len(least))
        candidate[-1] = limiting[stop]
        limiting[first : stop + 1] = np.minimum.accumulate(candidate[::-1], axis=0)[::-1]
        least[first] = until_end[0]
        stop = first
    return limiting

"""The sets of one fixed reference in the plane of the DCM: what is left of an N-step set when nothing is re-planned.

Under u = mu_k + k (xi - xi_k) the DCM error shrinks by lambda a tick, so the set of phase k is that of the next one
over lambda, cut by M_k (mu_k + k e) <= v_k; the last one is that of the regulator. With DCM gains these are the sets
kO_inf of `tracking_sets`, by the tick recursion of the N-step sets with the law in place of the choice.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.admissible.dcm_plane import directions_of
from controllers.admissible.moa import MoaSet
from controllers.gains import dcm, dcm_contraction
from controllers.geometry.polytope import Polytope
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference
from models.errors import InputError


def reference_polygons(
    pendulum: Pendulum, gain_k: float, reference: Reference, terminal: MoaSet
) -> tuple[Polytope, ...]:
    """DCMs (2-D, world frame) from which tracking the reference, then regulating, keeps the ZMP inside for ever.

    Args:
        pendulum: model and period, those of the reference and of the terminal set.
        gain_k: DCM gain of the tracker.
        reference: what is tracked.
        terminal: set of a regulator with a DCM gain and no bounds; the sets withstand the same errors as it does.

    Returns:
        For each phase 0..m, unit normals (r, 2) and offsets [m]; not all rows need cut.

    Raises:
        InputError: the terminal regulator has no DCM gain, or bounds.
        UnstableGainError: the gain does not converge.
    """
    ratio = terminal.gain.dcm_ratio(pendulum)
    if ratio is None or terminal.bounds is not None:
        raise InputError(f"terminal: must be the set of a DCM gain without bounds, got {terminal.gain.name!r}")
    dcm(pendulum, gain_k)
    contraction = dcm_contraction(pendulum, gain_k)
    normals, edges = directions_of((*reference.supports, terminal.polygon))
    lost = np.zeros(len(normals)) if terminal.error is None else terminal.error.support(normals)
    growth = math.expm1(pendulum.omega * pendulum.dt)
    path = pendulum.dcm(reference.xi)
    offsets = np.full(len(normals), np.inf)
    facing = edges[-1] >= 0
    offsets[facing] = (terminal.a / ratio)[edges[-1, facing]]
    offsets -= normals @ (path[-1] - terminal.centre)
    found = [_polygon(normals, offsets, path[-1])]
    for k in range(reference.m - 1, -1, -1):
        support = reference.support(k)
        own = edges[reference.support_of[k]]
        offsets = (offsets - growth * lost) / contraction
        facing = own >= 0
        room = (support.v - support.M @ reference.mu[k])[own[facing]] - lost[facing]
        offsets[facing] = np.minimum(offsets[facing], room / gain_k)
        found.append(_polygon(normals, offsets, path[k]))
    return tuple(found[::-1])


def _polygon(normals: np.ndarray, offsets: np.ndarray, at: np.ndarray) -> Polytope:
    finite = np.isfinite(offsets)
    return Polytope(S=normals[finite], a=offsets[finite] + normals[finite] @ at)

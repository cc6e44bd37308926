"""Tracking sets of any gain by the backward recursion, pruned every few phases."""

from __future__ import annotations

import numpy as np

from controllers.admissible.moa import MoaSet
from controllers.gains import Gain
from controllers.geometry.polytope import EmptyPolytopeError, Polytope
from controllers.pendulum import Pendulum
from controllers.reference.reference import Reference

# Phases between two prunings: rows between them cost less than a pruning of every phase.
_PRUNE_EVERY = 10

Rows = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def backward(pendulum: Pendulum, gain: Gain, reference: Reference, terminal: MoaSet) -> Rows:
    """Rows of all phases: S, a (in x), first row of each phase, and sample and edge of each row."""
    error = terminal.error
    loop, m = gain.closed_loop(pendulum), reference.m
    outputs = [(-polygon.M @ gain.F, np.arange(len(polygon.v))) for polygon in reference.supports]
    S = terminal.S
    a = terminal.a - S @ (reference.xi[-1] - terminal.x_C)
    sample, edge = m + terminal.sample, terminal.edge
    phases = [(S, a, sample, edge)]
    for k in range(m - 1, -1, -1):
        polygon = reference.supports[reference.support_of[k]]
        C, edges = outputs[reference.support_of[k]]
        margin = polygon.v - polygon.M @ reference.mu[k]
        if error is not None:
            # All successors Atilde e + B w must be in the next set, and this ZMP errs by w already.
            margin, a = margin - error.support(polygon.M), a - error.support(S @ pendulum.B)
        S = np.concatenate((C, S @ loop))
        a = np.concatenate((margin, a))
        sample, edge = np.concatenate((np.full(len(C), k), sample)), np.concatenate((edges, edge))
        if (m - k) % _PRUNE_EVERY == 0 or k == 0:
            try:
                keep = Polytope(S=S, a=a).irredundant()
            except EmptyPolytopeError:
                # A reference that is not admissible may leave nothing: all rows stay, no state has slack.
                keep = np.arange(len(S))
            S, a, sample, edge = S[keep], a[keep], sample[keep], edge[keep]
        phases.append((S, a, sample, edge))
    phases.reverse()
    rows = [len(phase[1]) for phase in phases]
    flat_S, flat_a, flat_sample, flat_edge = (np.concatenate(parts) for parts in zip(*phases, strict=True))
    flat_a = flat_a + np.einsum("rn,rn->r", flat_S, np.repeat(reference.xi, rows, axis=0))
    return flat_S, flat_a, np.concatenate(([0], np.cumsum(rows))), flat_sample, flat_edge

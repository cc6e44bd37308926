"""Tests that draw frames: without a renderer they are skipped, and say which package to install."""

from __future__ import annotations

import pytest

from sim.viz.video import missing_renderer

_missing = missing_renderer()
needs_renderer = pytest.mark.skipif(_missing is not None, reason=str(_missing))

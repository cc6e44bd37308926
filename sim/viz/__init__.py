"""The room sim/viz."""

"""The room sim/results."""

"""The room sim/report."""

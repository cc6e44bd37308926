"""The room sim/analysis."""

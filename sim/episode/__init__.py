"""The room sim/episode."""

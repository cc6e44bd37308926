"""The room sim/cli."""

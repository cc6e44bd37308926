"""The room sim/record."""

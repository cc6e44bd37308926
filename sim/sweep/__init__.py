"""The room sim/sweep."""

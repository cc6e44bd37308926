"""The room sim/set_study."""

"""The room sim/envs."""

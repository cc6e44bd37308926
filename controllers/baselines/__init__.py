"""The room controllers/baselines."""

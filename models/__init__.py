"""The body: robot descriptions (MJCF) and the facts read off the compiled model."""

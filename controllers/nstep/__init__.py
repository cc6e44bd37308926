"""The room controllers/nstep."""

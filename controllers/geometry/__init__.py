"""The room controllers/geometry."""

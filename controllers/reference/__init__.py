"""The room controllers/reference."""

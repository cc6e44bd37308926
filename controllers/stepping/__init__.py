"""The room controllers/stepping."""

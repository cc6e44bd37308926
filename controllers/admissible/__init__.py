"""The room controllers/admissible."""

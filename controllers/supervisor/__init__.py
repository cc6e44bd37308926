"""The room controllers/supervisor."""

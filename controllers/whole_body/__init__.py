"""The room controllers/whole_body."""

"""What a sweep looks like: one page complete in itself, pictures for documents, and films of its hardest pushes."""

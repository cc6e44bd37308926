"""Chooses between standing and stepping by MOA membership, and carries either out: the testbed's own controller."""

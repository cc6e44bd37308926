"""Compiled kernels of the dynamics of a floating body: what soles add, elimination of the base, weighted programs."""

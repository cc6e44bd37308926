"""Whole-body layers: a balance command becomes joint targets, on placo's model of the body, or as a held pose."""

"""Whole-body layers: a balance command becomes joint targets, by placo or as a held pose."""

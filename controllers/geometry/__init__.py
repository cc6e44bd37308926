"""Convex geometry of the ground and of state space: support polygons, hulls, polytopes, linear programs."""

from controllers.geometry.polytope import EmptyPolytopeError, Polytope
from controllers.geometry.support_polygon import Foot, SupportError, SupportPolygon, support_polygon

__all__ = ["EmptyPolytopeError", "Foot", "Polytope", "SupportError", "SupportPolygon", "support_polygon"]

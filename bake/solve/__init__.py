"""Mapping surface samples to per-vertex values."""

from bake.solve.ahead import map_ahead
from bake.solve.mapper import VertexMapper, map_to_vertices
from bake.solve.update import FieldKeeper, FieldUpdate

__all__ = ["FieldKeeper", "FieldUpdate", "VertexMapper", "map_ahead", "map_to_vertices"]

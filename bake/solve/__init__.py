"""Mapping surface samples to per-vertex values."""

from bake.solve.mapper import VertexMapper, map_to_vertices

__all__ = ["VertexMapper", "map_to_vertices"]

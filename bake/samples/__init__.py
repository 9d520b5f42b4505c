"""Where AO is estimated: points on the surface."""

from bake.samples.surface import place_samples

__all__ = ["place_samples"]

"""Obscura's engine: scene in, per-vertex ambient obscurance out.

It knows no window toolkit; importing it loads neither Warp nor Embree.
"""

__version__ = "0.1.0"

"""What is odd about a scene, listed by object."""

from __future__ import annotations

from bake.types import Finding, Scene


def find_problems(scene: Scene) -> list[Finding]:
    """Findings in scene order."""
    return []

"""What of a result's decorators is shown: one frozen value that the panel edits and the presenter draws."""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass


class TreeShading(enum.StrEnum):
    """Which model colours the trees (Sloan et al. 2013, figure 2)."""

    NONE = "none"
    LINEAR = "linear"
    PRODUCT = "product"
    GOLD = "gold"
    LOCAL = "local"


TREE_WORDS = {
    TreeShading.NONE: "not baked",
    TreeShading.LINEAR: "global only",
    TreeShading.PRODUCT: "local × global",
    TreeShading.GOLD: "gold",
    TreeShading.LOCAL: "local only",
}


class FogColor(enum.StrEnum):
    """What colours the boxes of fog."""

    USED = "used"
    GIVEN = "given"
    LOST = "lost"


class VoxelColor(enum.StrEnum):
    """What colours the voxels of the tree volume."""

    VALIDITY = "validity"
    AO = "ao"


ALL_LAYERS = -1


@dataclass(frozen=True, slots=True)
class DecoratorView:
    """What the user chose to see.

    Attributes:
        trees: How trees are coloured.
        scalars: Whether shrubs and small decorators are coloured by their scalar.
        fog: How the boxes of fog are coloured; None: they are not drawn.
        bricks: Whether the volume's bricks are drawn.
        voxels: How the volume's voxels are coloured; None: they are not drawn.
        layer: Grid coordinate of the drawn slice along the up axis; `ALL_LAYERS` for the whole volume.
        column: Distance at which voxels are evaluated.
        direction: Index into `viewer.volume_view.DIRECTIONS`.
        voxel: Voxel whose harmonics are drawn; -1 for none.
    """

    trees: TreeShading = TreeShading.PRODUCT
    scalars: bool = True
    fog: FogColor | None = None
    bricks: bool = False
    voxels: VoxelColor | None = None
    layer: int = ALL_LAYERS
    column: int = 0
    direction: int = 0
    voxel: int = -1

    def replaced(self, **changes: object) -> DecoratorView:
        """A copy with some choices changed."""
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

"""What was published about two bakes, stage by stage."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PublishedStage:
    """One line of a published table.

    Attributes:
        name: As published.
        seconds: As published; 1 where it says "less than a second".
        ours: Our stages that do the same.
        mrays: Rays that the line stands for, in millions; 0 if it traces none or does not say.
        below: The publication gives a bound only.
    """

    name: str
    seconds: float
    ours: tuple[str, ...]
    mrays: float = 0.0
    below: bool = False


LEVEL_SOURCE = "Sloan et al. 2013, Table 1, NVIDIA K20"
LEVEL = (
    PublishedStage("process geometry, 1.5 M vertices, 1.8 M faces", 2.0, ("process geometry", "flatten")),
    PublishedStage("sample meshes, 6.7 M samples", 1.0, ("sample surface",), below=True),
    PublishedStage("flatten 46 trees, 7,856 fog boxes", 1.0, ("fog",), below=True),
    PublishedStage("BVH build", 10.5, ("build BVH",)),
    PublishedStage("trace samples × 256", 35.1, ("trace",), 6.7 * 256),
    PublishedStage("tree volume, 11,829 points × 1,024", 0.53, ("tree volume",), 0.011829 * 1024),
    PublishedStage("trace regions, 332,741 points × 1,024", 9.2, ("region probes",), 0.332741 * 1024),
    PublishedStage("least squares", 8.6, ("map to vertices",)),
    PublishedStage("resample LODs, 5.7 M points", 5.7, ("BVH of baked surface", "resample LODs")),
    PublishedStage("least squares of LODs, 0.65 M vertices, 0.8 M faces", 4.2, ("map LODs",)),
)
LEVEL_TOTAL_S = 78.0

SLED_SOURCE = "NVIDIA OptiX Prime baking sample, Quadro M6000"
SLED = (
    PublishedStage("load, 348,015 vertices, 418,036 triangles", 0.09652, ("process geometry", "flatten")),
    PublishedStage("sample points, 1,254,108", 0.03811, ("sample surface",)),
    PublishedStage("setup of the tracer", 0.50266, ("build BVH",)),
    PublishedStage("query, 64 rays a sample", 0.64405, ("trace",), 80.262912),
    PublishedStage("AO to vertices", 0.31544, ("map to vertices",)),
)
SLED_TOTAL_S = 0.09652 + 0.03811 + 1.16071 + 0.31544

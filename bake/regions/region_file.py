"""Region files: boxes, links, seeds and validity bits as JSON, read and written.

    {"regions": [{"name": "hall", "min": [0, 0, 0], "max": [8, 3, 12], "seed": [4, 1, 6], "valid": "ff…"}],
     "links": [{"a": "hall", "b": "yard", "area": 2.2, "centre": [8, 1, 6]}],
     "seeds": [[0, 1, 0]]}

Everything is in world metres. Only `name`, `min` and `max` must be there. Without `links` those that boxes share are
found; a link without `area` and `centre` has them measured. `valid` holds a region's 512 bits as 128 hexadecimal
digits, the first point's bit first. A file with `seeds` instead of `regions` asks for automatic regions around these
points.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bake.arrays import BoolArray
from bake.errors import SceneError, StorageError
from bake.region_types import GRID, RegionGraph
from bake.regions.region_checks import checked
from bake.regions.region_document import RegionFile, bits_to_hex
from bake.types import Float64Array


def read_region_file(path: Path) -> RegionFile:
    """Reads and checks a region file.

    Raises:
        SceneError: it is missing, no JSON, or says something that cannot be; the message names the region.
    """
    return checked(_parse(path), str(path))


def write_region_file(path: Path, graph: RegionGraph, *, origin: Float64Array, valid: BoolArray | None = None) -> None:
    """Writes regions, seeds and links, so that `read_region_file` and a bake give them again.

    Args:
        path: Replaced as a whole, or not at all.
        graph: Relative to `origin`.
        origin: `World.origin`, shape (3,).
        valid: Shape (r · GRID³,), bool: which points count, written if given.

    Raises:
        StorageError: the file cannot be written.
    """
    regions: list[dict[str, Any]] = []
    for number, name in enumerate(graph.names):
        entry: dict[str, Any] = {
            "name": name,
            "min": (graph.minimum[number] + origin).tolist(),
            "max": (graph.maximum[number] + origin).tolist(),
            "seed": (graph.seed[number] + origin).tolist(),
        }
        if valid is not None:
            entry["valid"] = bits_to_hex(valid[number * GRID**3 : (number + 1) * GRID**3])
        regions.append(entry)
    pairs: list[tuple[int, int]] = graph.link.tolist()
    links: list[dict[str, Any]] = [
        {"a": graph.names[a], "b": graph.names[b], "area": float(area), "centre": (centre + origin).tolist()}
        for (a, b), area, centre in zip(pairs, graph.link_area, graph.link_centre, strict=True)
    ]
    text = json.dumps({"regions": regions, "links": links}, indent=1, ensure_ascii=False) + "\n"
    temporary = path.with_name(path.name + ".part")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as problem:
        raise StorageError(f"the region file cannot be written: {problem.strerror}", where=str(path)) from None


def _parse(path: Path) -> Any:
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise SceneError("the region file is missing", where=str(path), remedy="check the path") from None
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) and problem.strerror else str(problem)
        raise SceneError(f"the region file cannot be read: {reason}", where=str(path)) from None
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise SceneError("the region file is no UTF-8 text", where=str(path), remedy="save it as UTF-8") from None
    except (ValueError, RecursionError) as problem:
        raise SceneError(f"the region file is no JSON: {problem}", where=str(path)) from None

"""Results on disk: a folder with a manifest and memory-mapped arrays, committed atomically."""

from bake.results.keep import keep_result, put_back, take_away
from bake.results.load import load_result
from bake.results.manifest import Manifest, is_result, read_manifest
from bake.results.save import check_destination, save_result
from bake.results.unchanged import is_current

__all__ = [
    "Manifest",
    "check_destination",
    "is_current",
    "is_result",
    "keep_result",
    "load_result",
    "put_back",
    "read_manifest",
    "save_result",
    "take_away",
]

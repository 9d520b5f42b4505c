"""The subcommands, one module each: `USAGE`, `add_arguments(parser)` and `run(arguments) -> exit code`."""

from collections.abc import Mapping

COMMANDS: Mapping[str, str] = {
    "bake": "bake a scene without a window",
    "rebake": "bring a result up to date with its scene, baking only what the changes can reach",
    "explain": "say why a spot has its value: samples, rays, occluders and causes",
    "spots": "list suspicious places of a result, the gravest first",
    "remedy": "preview what would mend a spot, and write it into the side file",
    "export": "write a result as .npz, .ply, .glb, .obj or .vao",
    "walk": "walk a character through the regions and find where it pops",
    "regions": "list, check and export the regions in which objects move",
    "report": "write one self-contained page about a result",
    "bench": "measure accuracy and speed",
    "doctor": "say what this machine has, what is missing and how to mend it",
}

"""`bench accuracy|speed|stability|…`: prints the tables that the documentation quotes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.commands.accuracy_tables import AccuracyRequest, accuracy_tables
from app.commands.console import note, say, say_json
from app.commands.settings_options import add_settings_options, explicit_options
from app.commands.speed_tables import add_speed_arguments, speed_tables
from app.commands.written_tables import write_table
from bake.errors import InputError

if TYPE_CHECKING:
    from bake.bench.table import Measurements

USAGE = (
    "accuracy|adaptive|alpha|mapping|speed|workloads|stability|scenes|lods|trees|fog|regions|causes|explain|rebake|window|"
    "edits [SCENE | FOLDER …] [--scale X] [--whole-scene] [--scales X,…] [--peers PYTHON] [--placements N] "
    "[--injection-seed N] [--edits N] [--edit-seeds N,…] [--bound B] [--minutes X] [--largest N] [--tables NAME,…] "
    "[--share X] [--keep FOLDER] [--plots FOLDER] [--into PAGE] [--json] [settings]"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("subject", choices=list(_SUBJECTS), help="accuracy: run time against surface error, ours at "
                        "many settings and other bakers, and the error of ways to choose directions; "
                        "adaptive: what adaptive rays save at equal error; "
                        "alpha: the smoothing that the samples ask for themselves against the best; "
                        "mapping: surface error of the mappings; speed: "
                        "seconds and memory by stage and scale, overhead beyond the rays, the solver at size, "
                        "starts, and on CUDA the choice of BVH; workloads: two published bakes in size, stage by "
                        "stage; stability: a small level of its own "
                        "distorted in every way that breaks bakers, every tracer and stage held to gates; "
                        "scenes: what each scene holds and what baking it costs; lods: error of the lower levels of "
                        "detail against what is traced on the finest one; trees: error of the three models of a "
                        "tree's AO against what is traced on it; fog: what shrubs as boxes cost, and how "
                        "close they come to the real foliage; regions: what dynamic regions hold and cost, and what a "
                        "walk through them shows; causes: how often the cause of an injected dark spot is named "
                        "rightly; explain: error and time of explanations and counterfactuals; rebake: random "
                        "edits, each rebake held against a whole bake; window: how soon the "
                        "window is there and answers, on a level of its own or on one scene or result; "
                        "edits: how soon the window shows what an edit changes, against a whole bake")  # fmt: skip
    parser.add_argument("paths", type=Path, nargs="*", metavar="SCENE | FOLDER", help="scenes to measure on")
    parser.add_argument(
        "--scale", type=float, default=1.0, help="metres in a unit of the scenes (accuracy, adaptive and mapping)"
    )
    parser.add_argument(
        "--whole-scene",
        action="store_true",
        help="errors of all vertices with one seed, not of patches (adaptive only)",
    )
    parser.add_argument(
        "--plots",
        type=Path,
        metavar="FOLDER",
        help="draw what was measured there, as .png (accuracy, rebake, regions, speed, stability and trees only)",
    )
    parser.add_argument(
        "--scales", metavar="X,…", default="", help="metres in a unit of each scene (causes and explain)"
    )
    parser.add_argument(
        "--placements", type=int, default=20, metavar="N", help="placements of each cause in each scene (causes only)"
    )
    parser.add_argument(
        "--injection-seed", type=int, metavar="N", help="decides places and measures of injections (causes only)"
    )
    parser.add_argument(
        "--keep",
        type=Path,
        metavar="FOLDER",
        help="keep there what is traced, and go on from there when scene and settings are the same "
        "(regions and rebake)",
    )
    parser.add_argument(
        "--peers",
        type=Path,
        metavar="PYTHON",
        help="an interpreter that has other bakers installed: bpy, open3d, libigl, pymeshlab (accuracy only)",
    )
    parser.add_argument(
        "--edits", type=int, metavar="N", help="edits in each scene (rebake, 100), or in a row (edits, none)"
    )
    parser.add_argument(
        "--edit-seeds", default="1", metavar="N,…", help="a row of edits in each scene for each (rebake only)"
    )
    parser.add_argument("--bound", default="1/512", metavar="B", help="most AO skipped for a sample (rebake only)")
    parser.add_argument(
        "--minutes", type=float, default=None, metavar="X", help="begin no edit after so many (rebake only)"
    )
    parser.add_argument(
        "--into", type=Path, metavar="PAGE", help="put the tables between the page's marks of their names as well"
    )
    add_speed_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object a table, a line each")
    add_settings_options(parser)


def run(arguments: argparse.Namespace) -> int:
    """Measures and prints; the exit code is 1 if a gate did not hold.

    Raises:
        InputError: no scene was given to a benchmark that needs some.
    """
    passed = True
    for measured in _SUBJECTS[arguments.subject](arguments):
        if arguments.json:
            say_json({**measured.to_json(), "asked": _asked(arguments)})
        else:
            say(f"### {measured.name}\n\n{measured.to_markdown()}\n")
        if arguments.into is not None and not write_table(arguments.into, measured.name, measured.to_markdown()):
            note(f"{arguments.into} has no place for {measured.name!r}")
        passed = passed and measured.passed
    return 0 if passed else 1


def _asked(arguments: argparse.Namespace) -> dict[str, Any]:
    """Everything that was asked for, defaults of the command included and scenes by name, as plain values."""
    said = {name: value for name, value in vars(arguments).items() if isinstance(value, str | int | float | Path)}
    plain = {name: value.name if isinstance(value, Path) else value for name, value in said.items()}
    settings = explicit_options(arguments)
    return {
        **{name: value for name, value in plain.items() if value != "" and not name.startswith("setting:")},
        "paths": [path.name for path in arguments.paths],
        "settings": settings,
    }


def _accuracy(arguments: argparse.Namespace) -> Iterable[Measurements]:
    return accuracy_tables(
        AccuracyRequest(
            scenes=_scenes(arguments) if arguments.paths else [],
            options=explicit_options(arguments),
            tables=arguments.tables,
            peers=arguments.peers,
            scale=arguments.scale,
            plots=arguments.plots,
            page=arguments.into,
        )
    )


def _adaptive(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.adaptive import measure_adaptive

    scenes, options = _scenes(arguments), explicit_options(arguments)
    return [measure_adaptive(scenes, options, scale=arguments.scale, whole=arguments.whole_scene)]


def _alpha(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.alpha import measure_alpha

    return [measure_alpha(_scenes(arguments) if arguments.paths else [], explicit_options(arguments))]


def _mappings(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.mapping import measure_mappings

    return [measure_mappings(_scenes(arguments), explicit_options(arguments), scale=arguments.scale)]


def _speed(arguments: argparse.Namespace) -> Iterable[Measurements]:
    scenes, options = _scenes(arguments) if arguments.paths else [], explicit_options(arguments)
    return speed_tables(scenes, options, tables=arguments.tables, largest=arguments.largest, plots=arguments.plots)


def _workloads(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from bake.bench.workload import measure_workloads

    return measure_workloads(explicit_options(arguments), share=arguments.share)


def _stability(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.stability import measure_stability, tables

    if arguments.paths:
        where = str(arguments.paths[0])
        raise InputError("it makes its own scenes", where=where, remedy="name none: `bench stability`")
    if arguments.plots is not None:
        arguments.plots.mkdir(parents=True, exist_ok=True)  # before minutes of measuring
    matrix = measure_stability(explicit_options(arguments))
    if arguments.plots is not None:
        from app.commands.stability_plot import plot_stability

        plot_stability(arguments.plots / "stability.png", matrix)
    return tables(matrix)


def _scene_table(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.scenes import measure_scenes

    return [measure_scenes(_scenes(arguments), explicit_options(arguments))]


def _lods(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.lods import measure_lods

    return [measure_lods(_scenes(arguments), explicit_options(arguments))]


def _tree_models(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.trees import measure_trees

    if arguments.plots is not None:
        arguments.plots.mkdir(parents=True, exist_ok=True)  # before minutes of measuring
    measured = measure_trees(_scenes(arguments), explicit_options(arguments), draw=arguments.plots is not None)
    if arguments.plots is not None:
        from app.commands.tree_plot import plot_tree

        for figure in measured.figures:
            name = figure.tree.rpartition("/")[2].replace("#", "-")
            plot_tree(arguments.plots / f"tree-{figure.scene}-{name}.png", figure)
    return list(measured.tables)


def _fog(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from bake.bench.fog import measure_fog

    scenes = _scenes(arguments) if arguments.paths else []
    return measure_fog(scenes, explicit_options(arguments))


def _regions(arguments: argparse.Namespace) -> list[Measurements]:
    from bake.bench.region_scale import measure_scale
    from bake.bench.regions import measure_regions

    scenes = _scenes(arguments) if arguments.paths else []
    measured = measure_regions(scenes, explicit_options(arguments), folder=arguments.keep)
    if arguments.plots is not None:
        from app.commands.region_plot import plot_regions
        from app.commands.walk_plot import plot_walk

        for scene in measured.scenes:
            plot_regions(
                arguments.plots / f"regions-{scene.name}.png",
                scene.regions,
                distances=scene.distances,
                title=scene.name,
            )
            for walk, distance in zip(scene.walks, scene.distances, strict=True):
                plot_walk(
                    arguments.plots / f"walk-{scene.name}-{distance:g}m.png",
                    walk,
                    names=scene.regions.graph.names,
                    distance=distance,
                    title=scene.name,
                )
    return [*measured.tables, measure_scale()]


def _causes(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from bake.bench.causes import SEED, measure_causes

    scenes, scales = _scaled_scenes(arguments)
    seed = SEED if arguments.injection_seed is None else arguments.injection_seed
    options = explicit_options(arguments)
    return measure_causes(scenes, options, scales=scales, placements=arguments.placements, seed=seed)


def _explain(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from bake.bench.explain import measure_explanations

    scenes, scales = _scaled_scenes(arguments)
    return measure_explanations(scenes, explicit_options(arguments), scales=scales)


def _rebake(arguments: argparse.Namespace) -> list[Measurements]:
    from app.commands.rebake import bound_of
    from bake.bench.rebake import measure_rebakes
    from bake.bench.rebake_tables import gates

    bound = bound_of(arguments.bound)
    tables, rows = measure_rebakes(
        _scenes(arguments),
        explicit_options(arguments),
        edits=100 if arguments.edits is None else arguments.edits,
        bound=bound,
        seeds=_edit_seeds(arguments.edit_seeds),
        keep=arguments.keep,
        seconds=float("inf") if arguments.minutes is None else 60.0 * arguments.minutes,
    )
    if arguments.plots is not None and rows:
        from app.commands.rebake_plot import plot_rebakes

        arguments.plots.mkdir(parents=True, exist_ok=True)
        largest, rms = gates(bound)
        plot_rebakes(arguments.plots / "rebake.png", rows, largest=largest, rms=rms)
    return tables


def _edit_seeds(text: str) -> tuple[int, ...]:
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{text!r} are no whole numbers", where="--edit-seeds", remedy="use 1 or 1,2") from None


def _window(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from app.window_bench.measure import measure_window

    return measure_window(_windowed(arguments), explicit_options(arguments))


def _edits(arguments: argparse.Namespace) -> Iterable[Measurements]:
    from app.window_bench.rebakes import measure_edits

    path = _windowed(arguments)
    if path is not None and path.is_dir():
        raise InputError("is no scene", where=str(path), remedy="name a scene file; a copy of it is edited")
    return measure_edits(path, explicit_options(arguments), edits=arguments.edits or 0)


def _windowed(arguments: argparse.Namespace) -> Path | None:
    """The one path to open in a window, if any is given and there is a display."""
    from app.commands.window import has_display

    path = next(iter(arguments.paths), None)
    if len(arguments.paths) > 1 or (path is not None and not path.exists()):
        what = "one scene or result at a time" if len(arguments.paths) > 1 else "no such scene or result"
        raise InputError(what, where=str(arguments.paths[-1]), remedy="name one, or none for the benchmark's own level")
    if not has_display():
        where = f"bench {arguments.subject}"
        raise InputError("no display to open a window on", where=where, remedy="run it under xvfb-run")
    return path


def _scaled_scenes(arguments: argparse.Namespace) -> tuple[list[Path], list[float]]:
    """The scenes, in the order given or those of a folder, and the scales that go with them."""
    from bake.bench.scenes import find_scenes

    try:
        scales = [float(text) for text in arguments.scales.split(",") if text]
    except ValueError:
        raise InputError(
            f"{arguments.scales!r} is no list of numbers", where="--scales", remedy="write 1,0.05"
        ) from None
    return (find_scenes(_scenes(arguments)) if len(arguments.paths) == 1 else _scenes(arguments)), scales


def _scenes(arguments: argparse.Namespace) -> list[Path]:
    missing = [path for path in arguments.paths if not path.exists()]
    if missing or not arguments.paths:
        what = "no such scene or folder" if missing else "no scene given"
        raise InputError(what, where=str(missing[0]) if missing else "bench", remedy="name scene files or folders")
    return arguments.paths


_SUBJECTS: dict[str, Callable[[argparse.Namespace], Iterable[Measurements]]] = {
    "accuracy": _accuracy,
    "adaptive": _adaptive,
    "alpha": _alpha,
    "mapping": _mappings,
    "speed": _speed,
    "workloads": _workloads,
    "stability": _stability,
    "scenes": _scene_table,
    "lods": _lods,
    "trees": _tree_models,
    "fog": _fog,
    "regions": _regions,
    "causes": _causes,
    "explain": _explain,
    "rebake": _rebake,
    "window": _window,
    "edits": _edits,
}

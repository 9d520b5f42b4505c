"""How often the cause of a dark spot is named rightly: defects injected into real scenes, as a confusion matrix.

Each cause is injected until it has shown itself the wanted number of times in each scene: a defect must be darker than
what rays from its spot see once it is mended, a true crevice must be dark and right. What the classifier says is then
held against what was injected. The measures, places and turns follow from a seed; the classifier's thresholds were
chosen on other seeds.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bake.arrays import Float64Array
from bake.bench.cause_rounds import Round, Site, find_places, make_round
from bake.bench.cause_tables import Outcome, by_variant, confusion, of_the_levels
from bake.bench.injected_defects import make_injection
from bake.bench.level_spots import level_round
from bake.bench.remedy_previews import Mended, mend_round, preview_table
from bake.bench.scaled import scaled
from bake.bench.special_rounds import shell_round, turned_round, unit_round
from bake.bench.table import Measurements, bake_seed
from bake.explain.cause_names import CauseKind
from bake.explain.causes import name_causes
from bake.explain.explainer import Explainer
from bake.pipeline import settings_for
from bake.scene import load_scene
from bake.settings import BakeSettings

PLACEMENTS = 20
SPECIAL = 5
"""Of these, how many are wide shells, wrong units or turned objects of the level."""

MOST_ROUNDS = 40
SIZES = (1.0, 0.6, 0.35)
"""Sizes of the injections; the largest for which the scene has room is taken."""

AS_SEEN = 0.05
"""AO by which a level's own dark spot may differ from what its rays see, to count as right."""

ENOUGH_PLACES = 16
SEED = 20_26


def measure_causes(
    paths: Sequence[Path],
    options: Mapping[str, Any],
    *,
    scales: Sequence[float] = (),
    placements: int = PLACEMENTS,
    seed: int = SEED,
) -> Iterator[Measurements]:
    """One confusion matrix for each scene, as soon as it is done; then by kind of injection, previews, and all scenes.

    Args:
        paths: Scene files.
        options: Bake options by long name; 32 rays and 2 to 8 samples a face where they do not say.
        scales: Metres in a unit of each file; 1 for those without.
        placements: Of each cause in each scene.
        seed: Decides all measures and places.
    """
    outcomes: list[Outcome] = []
    sound: list[Outcome] = []
    mended: list[Mended] = []
    seeds = {"injections": seed, "bake": bake_seed(options)}
    for number, path in enumerate(paths):
        settings = settings_for(path, {"rays": 32, "samples-per-face": "2:8", "regions": "none", **options})
        scale = scales[number] if number < len(scales) else 1.0
        judged = judge_scene(path, settings, scale, placements, seed + number)
        sound += judge_level(path, settings, scale, placements, seed + number)
        mended += mend_scene(path, settings, scale, seed + number)
        outcomes += judged
        yield confusion(judged, f"causes in {path.stem}", seeds=seeds)
    yield by_variant(outcomes, seeds=seeds)
    yield of_the_levels(sound, seeds=seeds)
    yield preview_table(mended, seeds=seeds)
    yield confusion(outcomes, "causes", gated=True, seeds=seeds)


def judge_scene(path: Path, settings: BakeSettings, scale: float, placements: int, seed: int) -> list[Outcome]:
    """Injects, bakes and judges until every cause has shown itself `placements` times."""
    random = np.random.default_rng(seed)
    site, places = site_of(path, settings, scale, random)
    wanted = dict.fromkeys(CauseKind, placements)
    outcomes: list[Outcome] = []
    special = min(SPECIAL, placements)
    for made in _special_rounds(site, places, random, special):
        part = dict.fromkeys(CauseKind, special)
        outcomes += _taken(_taken(judge_round(made, site.name), part), wanted)
    for _ in range(MOST_ROUNDS):
        missing = [kind for kind, count in wanted.items() for _ in range(count)]
        if not missing or not len(places):
            break
        random.shuffle(missing)
        chosen = (missing * (1 + len(places) // len(missing)))[: min(len(places), 2 * len(missing))]
        injections = [make_injection(kind, random) for kind in chosen]
        spread = places[random.permutation(len(places))[: len(chosen)]]
        outcomes += _taken(judge_round(make_round(site, injections, spread, random), site.name), wanted)
    return outcomes


def judge_level(path: Path, settings: BakeSettings, scale: float, most: int, seed: int) -> list[Outcome]:
    """What is said of the level's own dark spots whose values are what their rays see."""
    scene = scaled(load_scene(path, crease_angle=settings.crease_angle), scale)
    made = level_round(Site(path.stem, scene, 1.0, settings), np.random.default_rng([seed, 2]), 2 * most)
    outcomes = judge_round(made, path.stem) if made is not None else []
    return [item for item in outcomes if abs(item.value - item.truth) < AS_SEEN][:most]


def mend_scene(path: Path, settings: BakeSettings, scale: float, seed: int) -> list[Mended]:
    """Previews of what is offered against injections of each cause, and the rebakes: each kind of remedy once."""
    random = np.random.default_rng([seed, 1])
    few = dataclasses.replace(settings, rays=8, samples_per_face=(2, 4))  # equality is no question of noise
    site, places = site_of(path, few, scale, random)
    curable = [kind for kind in CauseKind if kind.is_defect] * 2
    spread = places[random.permutation(len(places))[: len(curable)]]
    injections = [make_injection(kind, random) for kind in curable[: len(spread)]]
    rounds = [make_round(site, injections, spread, random) if injections else None, unit_round(site, places, random, 1)]
    mended: list[Mended] = []
    for made in rounds:
        if made is not None:
            mended += mend_round(made, site.name, {item.kind for item in mended})
    return mended


def site_of(path: Path, settings: BakeSettings, scale: float, random: np.random.Generator) -> tuple[Site, Float64Array]:
    """A scene to inject into, and where there is room: with injections as large as it has room for."""
    scene = scaled(load_scene(path, crease_angle=settings.crease_angle), scale)
    site, places = Site(path.stem, scene, SIZES[0], settings), np.zeros((0, 3))
    for size in SIZES:
        site = Site(path.stem, scene, size, settings)
        places = find_places(site, random, 130)
        if len(places) >= ENOUGH_PLACES:
            break
    return site, places


def judge_round(made: Round, site: str) -> list[Outcome]:
    """What is said of the injections that came out as meant."""
    outcomes: list[Outcome] = []
    with Explainer(made.result) as explainer:
        for number, item in enumerate(made.placed):
            if not made.manifest(number):
                continue
            injection = item.injection
            explanation = explainer.explain_face(int(made.face[number]), made.weights[number])
            distance = made.result.settings.column_distances[injection.column]
            first = name_causes(explainer, explanation, distance=distance)[0]
            value, truth = float(made.value[number]), float(made.truth[number])
            outcomes.append(
                Outcome(site, injection.cause, injection.variant, first.kind, first.confidence, value, truth)
            )
    return outcomes


def _special_rounds(site: Site, places: Float64Array, random: np.random.Generator, most: int) -> Iterator[Round]:
    made = turned_round(site, random, most)
    if made is not None:
        yield made
    for make in (unit_round, shell_round):
        shown = 0
        for _ in range(MOST_ROUNDS):
            made = make(site, places, random, 2 * most)
            if made is None:
                break
            shown += sum(made.manifest(number) for number in range(len(made.placed)))
            yield made
            if shown >= most:
                break


def _taken(outcomes: Sequence[Outcome], wanted: dict[CauseKind, int]) -> list[Outcome]:
    """Those that are still wanted."""
    kept: list[Outcome] = []
    for item in outcomes:
        if wanted[item.cause] > 0:
            wanted[item.cause] -= 1
            kept.append(item)
    return kept

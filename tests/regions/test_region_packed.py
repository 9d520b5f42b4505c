"""The packed form of the models, and the shader text that evaluates it."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bake.errors import ResultError, SettingsError
from bake.regions.evaluate import evaluate
from bake.regions.packed import INDEX_BYTES, MODEL_BYTES, PackedModels, evaluate_packed, model_bytes, pack
from bake.regions.packed_file import packed_text
from bake.regions.shader_text import glsl, hlsl
from tests.regions.synthetic import build_regions
from tests.results.synthetic_results import build_result

RESULT = dataclasses.replace(build_result(), regions=build_regions(4))

GLSL_PROGRAM = """#version 330
{functions}
uniform vec3 p;
uniform vec3 n;
uniform int model;
out vec4 colour;
void main() {{ colour = vec4(obscuraAO(obscuraModel(model, p), n)); }}
"""
HLSL_PROGRAM = """{functions}
float3 p; float3 n; int model;
float4 main() : SV_Target {{ return obscuraAO(obscuraModel(model, p), n).xxxx; }}
"""


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 1.0))
def test_packed_evaluation_is_that_of_linear_harmonics(seed: int, share: float) -> None:
    """In float32 and with one function, the packed models give the reference's linear AO, inside and outside boxes."""
    regions = RESULT.regions
    assert regions is not None
    random = np.random.default_rng(seed)
    region = random.integers(0, 4, 200)
    low, high = regions.graph.minimum[region], regions.graph.maximum[region]
    positions = low + random.uniform(-0.2, 1.2, (200, 3)) * (high - low)
    normals = random.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weights = np.array([share, 1.0 - share])
    packed = pack(regions, RESULT.world.origin, weights)
    found = evaluate_packed(packed, region, positions, normals)
    reference = evaluate(regions.regularised, region, positions, normals, bands=2, clamp=False) @ weights
    np.testing.assert_allclose(found, np.clip(reference, 0.0, 1.0), atol=2e-6)


def test_absorbed_regions_cost_a_number() -> None:
    """They are packed as the number of their owner's model, and each model once."""
    regions = build_regions(4)
    shared = dataclasses.replace(regions, owner=np.array([0, 0, 2, 2], np.int32))
    packed = pack(shared, np.zeros(3), np.array([0.0, 1.0]))
    assert packed.model.shape == (2, 8, 4)
    assert packed.region_model.tolist() == [0, 0, 1, 1]
    assert packed.model[0].nbytes == MODEL_BYTES == 128
    assert model_bytes(shared).tolist() == [MODEL_BYTES + INDEX_BYTES, INDEX_BYTES] * 2


def test_json_holds_all_that_an_engine_needs() -> None:
    """Models, boxes and links survive the file to the last bit, in world coordinates."""
    regions = RESULT.regions
    assert regions is not None
    content = json.loads(packed_text(RESULT, Path("x.json"), weights=(0.03, 0.97)))
    packed = PackedModels(
        origin=np.array(content["origin"]),
        model=np.array(content["models"], np.float32).reshape(-1, 8, 4),
        region_model=np.array([item["model"] for item in content["regions"]], np.int32),
    )
    same = pack(regions, RESULT.world.origin, np.array([0.03, 0.97]))
    np.testing.assert_array_equal(packed.model, same.model)
    np.testing.assert_array_equal(packed.region_model, same.region_model)
    np.testing.assert_allclose(content["regions"][0]["min"], regions.graph.minimum[0] + RESULT.world.origin)
    assert len(content["links"]) == 3
    assert content["weights"] == [0.03, 0.97]
    assert json.loads(packed_text(RESULT, Path("x.json")))["weights"] == [0.0, 1.0]


def test_refused_files() -> None:
    """Another suffix, weights that do not fit, and a result without regions are named."""
    with pytest.raises(SettingsError, match=r"\.fx"):
        packed_text(RESULT, Path("x.fx"))
    for weights in ((1.0,), (1.0, float("nan"))):
        with pytest.raises(SettingsError, match="one number each"):
            packed_text(RESULT, Path("x.json"), weights=weights)
    with pytest.raises(ResultError, match="no regions"):
        packed_text(build_result(), Path("x.json"))


def compile_shader(path: Path, *options: str) -> None:
    """Compiles a shader with glslangValidator, or skips."""
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("glslangValidator is not installed")
    done = subprocess.run([compiler, *options, str(path)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr


def test_glsl_compiles(tmp_path: Path) -> None:
    """The text is valid GLSL 3.30 as it stands."""
    path = tmp_path / "regions.frag"
    path.write_text(GLSL_PROGRAM.format(functions=glsl()))
    compile_shader(path)


def test_hlsl_compiles(tmp_path: Path) -> None:
    """The text is valid HLSL as it stands."""
    path = tmp_path / "regions.frag"
    path.write_text(HLSL_PROGRAM.format(functions=hlsl()))
    compile_shader(
        path, "-D", "-V", "-e", "main", "--auto-map-bindings", "--auto-map-locations", "-o", str(tmp_path / "o")
    )


def test_both_texts_say_the_same() -> None:
    """Word for word, but for the names of types and of the fetch, the two languages compute the same."""
    plain = glsl().split("vec4 obscuraModel")[1]
    for word, other in (
        ("texelFetch(obscuraModels, ", "obscuraModels.Load("),
        ("ivec3(lessThan(d, vec3(0.0)))", "int3(d.x < 0.0 ? 1 : 0, d.y < 0.0 ? 1 : 0, d.z < 0.0 ? 1 : 0)"),
        ("ivec3", "int3"),
        ("vec3", "float3"),
        ("vec4", "float4"),
    ):
        plain = plain.replace(word, other)
    assert plain == hlsl().split("float4 obscuraModel")[1]

"""The exported GLSL, run by OpenGL, against the reference evaluation."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista

from bake.regions.packed import evaluate_packed, pack
from bake.regions.shader_text import glsl
from tests.regions.synthetic import build_regions

SIZE = 32
NORMAL = np.array([0.3, 0.8, -0.5]) / np.linalg.norm([0.3, 0.8, -0.5])
PROGRAM = """
    vec2 place = gl_FragCoord.xy / {size}.0;
    vec3 p = vec3(18.0 * place.x - 1.0, 0.3 + 2.5 * fract(4.0 * place.y), 1.0 + 3.0 * place.x);
    vec3 n = vec3({normal});
    diffuseColor = vec3(0.0);
    ambientColor = vec3(obscuraAO(obscuraModel(int(4.0 * place.y), p), n));
    opacity = 1.0;
"""


def literals(values: np.ndarray) -> str:
    """Numbers as GLSL writes them."""
    return ", ".join(f"{float(value):.9e}" for value in values)


@pytest.mark.gui
def test_shader_computes_what_the_reference_does() -> None:
    """Every pixel evaluates a model at a place of its own; all agree to half a step of eight bits."""
    packed = pack(build_regions(4), np.zeros(3), np.array([0.3, 0.7]))
    rows = ", ".join(f"vec4({literals(row)})" for row in packed.model.reshape(-1, 4))
    # The text fetches from a buffer texture; here an array stands for it.
    table = f"const vec4 obscuraModels[{packed.model.size // 4}] = vec4[]({rows});\n#define texelFetch(t, row) t[row]"
    functions = glsl().replace("uniform samplerBuffer obscuraModels;", table)
    program = PROGRAM.format(size=SIZE, normal=literals(NORMAL))
    plotter = pyvista.Plotter(off_screen=True, window_size=[SIZE, SIZE])
    actor = plotter.add_mesh(pyvista.Plane(i_size=10, j_size=10), lighting=False, color="white")
    shaders = actor.GetShaderProperty()
    for where, text in (("//VTK::Normal::Dec", functions), ("//VTK::Color::Impl", program)):
        shaders.AddFragmentShaderReplacement(where, True, f"{where}\n{text}", False)
    plotter.camera_position = "xy"
    plotter.camera.zoom(5)
    picture = plotter.screenshot(return_img=True)
    plotter.close()
    assert picture is not None
    x, y = np.meshgrid((np.arange(SIZE) + 0.5) / SIZE, (np.arange(SIZE) + 0.5) / SIZE)
    positions = np.stack([18.0 * x - 1.0, 0.3 + 2.5 * ((4.0 * y) % 1.0), 1.0 + 3.0 * x], axis=-1).reshape(-1, 3)
    region = (4.0 * y).astype(np.int64).ravel()
    ao = evaluate_packed(packed, region, positions, np.tile(NORMAL, (len(positions), 1)))
    assert np.ptp(ao) > 0.2
    np.testing.assert_allclose(picture[::-1, :, 0].ravel() / 255.0, ao, atol=0.6 / 255.0)

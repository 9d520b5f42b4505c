"""The evaluation of packed models as GLSL and HLSL, to be included by an engine's shaders."""

from __future__ import annotations

_ABOUT = """\
// Ambient obscurance of dynamic objects: one model a visibility region, linear spherical harmonics of one function
// (after Sloan et al. 2013, "Ambient Obscurance Baking on the GPU", equation 4).
//
// {store} holds 8 texels a model, RGBA32F, in this order:
//   centre (xyz, 0), mean, then the derivatives toward +x, -x, +y, -y, +z, -z;
//   each of the seven is (factor of n.x, factor of n.y, factor of n.z, constant).
// model: the number of the region's model; p: position relative to the origin of the export, metres; n: unit normal.
// To blend in time, blend what obscuraModel returns: y += (x - y) * (1 - exp2(-dt / halfLife)).
"""

_GLSL = """\
uniform samplerBuffer obscuraModels;

vec4 obscuraModel(int model, vec3 p)
{
    int row = 8 * model;
    vec3 d = p - texelFetch(obscuraModels, row).xyz;
    ivec3 side = ivec3(lessThan(d, vec3(0.0)));
    vec4 v = texelFetch(obscuraModels, row + 1);
    v += d.x * texelFetch(obscuraModels, row + 2 + side.x);
    v += d.y * texelFetch(obscuraModels, row + 4 + side.y);
    v += d.z * texelFetch(obscuraModels, row + 6 + side.z);
    return v;
}

float obscuraAO(vec4 v, vec3 n)
{
    return clamp(dot(v, vec4(n, 1.0)), 0.0, 1.0);
}
"""

_HLSL = """\
Buffer<float4> obscuraModels;

float4 obscuraModel(int model, float3 p)
{
    int row = 8 * model;
    float3 d = p - obscuraModels.Load(row).xyz;
    int3 side = int3(d.x < 0.0 ? 1 : 0, d.y < 0.0 ? 1 : 0, d.z < 0.0 ? 1 : 0);
    float4 v = obscuraModels.Load(row + 1);
    v += d.x * obscuraModels.Load(row + 2 + side.x);
    v += d.y * obscuraModels.Load(row + 4 + side.y);
    v += d.z * obscuraModels.Load(row + 6 + side.z);
    return v;
}

float obscuraAO(float4 v, float3 n)
{
    return clamp(dot(v, float4(n, 1.0)), 0.0, 1.0);
}
"""


def glsl() -> str:
    """Two functions for GLSL 1.40 (OpenGL 3.1) and later; the includer states the version."""
    return _ABOUT.format(store="The buffer texture") + "\n" + _GLSL


def hlsl() -> str:
    """The same two for HLSL, shader model 4 and later."""
    return _ABOUT.format(store="The buffer") + "\n" + _HLSL

"""Device records of a render, except those of BVHs (accel.layouts). The kernels' typedefs are generated from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...device.programs.struct_types import record
from .lights.light_types import TYPES

TRIANGLE = record(p0="3f4", material="i4", p1="3f4", light="i4", p2="3f4", normals="i4")
NORMALS = record(n0="3f4", pad0="i4", n1="3f4", pad1="i4", n2="3f4", pad2="i4")
TEXCOORDS = record(uv0="2f4", uv1="2f4", uv2="2f4", pad="2f4")
COLORS = record(c0="4f4", c1="4f4", c2="4f4")
#: sign: of the bitangent, or 0 where there is no tangent.
TANGENTS = record(t0="3f4", sign="f4", t1="3f4", pad1="f4", t2="3f4", pad2="f4")
SPHERE = record(center="3f4", radius="f4", material="i4", light="i4", pad="2i4")
#: An instance (kernels/surface/instance_transform.cl). first: its mesh's first triangle; material: a code, or −1 for
#: the triangles' own; unit: 1 over the greatest entry of the matrix, negative if it mirrors.
PLACEMENT = record(
    to_world="(3,4)f4", rounding0="3f4", first="i4", rounding1="3f4", material="i4", rounding2="3f4", unit="f4"
)
#: The motion of an instance (kernels/geometry/motion.cl), as scene.geometry.motion defines it. from_inner, from_outer:
#: the inverses.
MOTION = record(
    middle="4f4",
    change="4f4",
    offset="3f4",
    angle="f4",
    moved="3f4",
    pad0="i4",
    growth="3f4",
    pad1="i4",
    inner="(3,4)f4",
    outer="(3,3)f4",
    from_inner="(3,3)f4",
    from_outer="(3,3)f4",
    pad2="i4",
)
#: The number of a placement's motion, or −1.
MOTION_NUMBER = np.dtype([("motion", "i4")])
#: Which rays a primitive is opaque to, whatever their direction: 0 not all, 1 all but camera rays, 2 all.
OPAQUE = np.dtype([("rays", "u1")])

#: A light, a group of lights, or an infinite light (kernels/light/choice.cl, tree.cl).
LIGHT_GROUP = record(
    center="3f4", radius="f4", axis="3f4", cos_cone="f4", intensity="f4", below="i4", above="i4", cos_reach="f4"
)
LIGHT_PLACE = np.dtype([("group", "i4")])
#: The number of an emitter's light group (kernels/light/groups.cl).
EMITTER_GROUP = np.dtype([("group", "i4")])
#: texture: of its radiance, or −1; primitive: the triangle with its texture coordinates; double_sided: 1 if it emits
#: from both sides.
TRIANGLE_LIGHT = record(
    p0="3f4",
    area="f4",
    e1="3f4",
    parallelogram="i4",
    e2="3f4",
    texture="i4",
    normal="3f4",
    primitive="i4",
    radiance="3f4",
    double_sided="i4",
)
#: The placement of a triangle light that moves, or −1.
LIGHT_PLACEMENT = np.dtype([("placement", "i4")])
#: sphere: its number among the spheres.
SPHERE_LIGHT = record(
    center="3f4", radius="f4", radiance="3f4", texture="i4", sphere="i4", double_sided="i4", pad="2i4"
)

#: Fields of an image. u_row, v_row: rows that map (u, v, 1) to the image's coordinates. first: of its texels.
_IMAGE = dict(
    u_row="3f4",
    width="i4",
    v_row="3f4",
    height="i4",
    first="i4",
    wrap_u="i4",
    wrap_v="i4",
    nearest="i4",
)
#: An image of lights.
LIGHT_IMAGE = record(**_IMAGE)
LIGHT_TEXEL = record(value="3f4", pad="f4")

ENVIRONMENT = record(color="3f4", pad="f4", width="i4", height="i4", rotation_cos="f4", rotation_sin="f4")
SKY_TEXEL = record(radiance="3f4", density="f4")
#: Fields are read one at a time, so records of half the size cost nothing: two of them share 16 bytes.
SKY_STEP = np.dtype([("top", "f4"), ("start", "i4")])

_COUNTED = ("triangles", "spheres", "lights", *(f"{kind}_lights" for kind in TYPES))
COUNTS = record(**dict.fromkeys(_COUNTED, "i4"), pad=f"({-len(_COUNTED) % 4 or 4},)i4")
#: clamped: if CLAMP is compiled in, the radiance that clamping removed from the samples, averaged over channels.
PIXEL = record(
    sum="3f4", count="u4", sum_error="3f4", dropped="u4", square="3f4", rays="u4", square_error="3f4", clamped="f4"
)
LAUNCH = record(
    position="3f4",
    width="u4",
    right="3f4",
    height="u4",
    up="3f4",
    max_depth="i4",
    forward="3f4",
    seed="u4",
    first_pixel="u4",
    pixel_count="u4",
    first_sample="u4",
    sample_count="u4",
    block_bits="u4",
    lens_radius="f4",
    clamp_direct="f4",
    clamp_indirect="f4",
)
#: The distortion of a lens (kernels/camera/radial_lens.cl), at the end of the launch records of cameras that have it.
#: across, down: rows that map (sx, sy, 1) to the image plane at distance 1; reach: the largest radius that has a ray.
LENS = record(numerator="4f4", denominator="3f4", reach="f4", across="3f4", p1="f4", down="3f4", p2="f4")
#: The exposure of images in which something moves: shares of its time in which a row's shutter is open, and by which
#: the last row's opens after the first's.
EXPOSURE = record(open_share="f4", row_share="f4", pad_exposure="2i4")
#: The motion of a camera (kernels/camera/moving.cl): of its position, and of right, up and forward (axes, and their
#: change) in its own frame, which turns as a MOTION does.
CAMERA_MOTION = record(
    turn_middle="4f4",
    turn_change="4f4",
    moved="3f4",
    turn_angle="f4",
    axes="(3,3)f4",
    axes_change="(3,3)f4",
    pad_axes="2i4",
)
#: The change of a distorting lens's image plane (kernels/camera/moving.cl), if the camera moves.
LENS_MOTION = record(across_change="3f4", pad_across="i4", down_change="3f4", pad_down="i4")
#: A ray of a RayList (kernels/camera/listed_rays.cl).
LISTED_RAY = record(origin="3f4", reach="f4", direction="3f4", pad0="i4", surface_normal="3f4", pad1="i4")
TEXTURE = record(
    **_IMAGE,
    uv_set="i4",
    shift="u4",
    pad="2i4",
)
TEXEL = np.dtype([("rgba", "u4")])
#: A node of a guiding field's spatial tree (kernels/guiding/field.cl). axis: of the position, 0 to 2, or of the normal,
#: 3 to 5, that is cut at `value`; child: the first of two. Of a leaf axis is −1, value the field's share, child the
#: first quarter of its quadtree; reflected: the mean luminance reflected there, without that of light sampling.
SPATIAL_NODE = record(axis="i4", value="f4", child="i4", reflected="f4")
#: A quarter of a quadtree's node: its share of the node's probability, and its own first quarter, or −1.
QUARTER = np.dtype([("share", "f4"), ("quarters", "i4")])
#: Linear value of an sRGB-encoded byte.
LINEAR = np.dtype([("linear", "f4")])
#: Denoiser guides of a pixel (kernels/aov/denoiser_guides.cl); every field not named pad is an image.
GUIDE = record(albedo="3f4", pad0="i4", normal="3f4", pad1="i4")
#: If DIRECT_LIGHT is compiled in, a pixel also stores the sum of its samples' direct light.
DIRECT = record(direct="3f4", pad0="u4", direct_error="3f4", pad1="u4")
#: If ALPHA is, the sum of their coverage. A film's pixels have a multiple of 32 bytes.
ALPHA = record(alpha="f4", alpha_error="f4", pad_alpha="6i4")
#: If CATCHER is, the sums of the light of those that see a catcher, with the objects and without, and their number.
CATCHER = record(
    caught="3f4",
    catcher="f4",
    caught_error="3f4",
    catcher_error="f4",
    bare="3f4",
    pad_bare="f4",
    bare_error="3f4",
    pad_bare_error="f4",
)


def group_record(groups: int) -> np.dtype[Any]:
    """Return the record that follows in a film's pixels if EMITTER_GROUPS is compiled in: for each group the sum of the
    samples' light, and its rounding error."""
    words = 6 * groups
    padding = {"pad_groups": f"({-words % 8},)i4"} if words % 8 else {}
    return record(groups=f"({groups},2,3)f4", **padding)


#: A launch of a scene with catchers; bare: whether its objects are left out.
LAUNCH_OF_CATCHERS = np.dtype([*LAUNCH.descr, *record(bare="i4", pad_bare="3i4").descr])
#: A projected primitive (kernels/raster/outline.cl). edge0 … nearness: functions of the image position, or for a sphere
#: its center and radius; instance: negative for spheres; rows: range of pixel rows that it may cover.
OUTLINE = record(
    edge0="3f4", primitive="i4", edge1="3f4", instance="i4", edge2="3f4", first_row="i4", nearness="3f4", last_row="i4"
)
#: An entry of the layer energy tables (clrt/scene/materials/layer_energy.py).
LAYER_PARTS = record(part="8f4")
#: A filter's quantile, in pixels from a pixel's edge.
FILTER = np.dtype([("quantile", "f4")])


class TextureNumber(int):
    """Index of a texture or of a light's image, an int32 in records; −1 for none."""


def texture_field(name: str) -> str:
    """Return the name of the field with the texture of a parameter (kernels/bsdf/interface.cl)."""
    return f"{name}_texture"


def parameter_record(values: Iterable[Mapping[str, Any]]) -> np.dtype[Any]:
    """Return the record of materials or lights of one type, with these values by name: the union over all of them.

    Rows of a multiple of four come first, as long as the longest, then triples, each followed by a scalar or padding,
    then the other scalars; texture numbers are int32.
    """
    sizes: dict[str, int] = {}
    scalar: dict[str, str] = {}
    for named in values:
        for name, value in named.items():
            sizes[name] = max(sizes.get(name, 0), len(value) if isinstance(value, tuple) else 1)
        scalar |= {name: "i4" if isinstance(value, TextureNumber) else "f4" for name, value in named.items()}
    triples = [name for name, size in sizes.items() if size == 3]
    scalars = [name for name, size in sizes.items() if size == 1]
    fields = {name: f"{size}f4" for name, size in sizes.items() if size > 3}
    for i, triple in enumerate(triples):
        fields[triple] = "3f4"
        name = scalars.pop(0) if scalars else f"pad{i}"
        fields[name] = scalar.get(name, "f4")
    for name in scalars:
        fields[name] = scalar[name]
    for i in range(-len(scalars) % 4):
        fields[f"rest{i}"] = "f4"
    return record(**fields)

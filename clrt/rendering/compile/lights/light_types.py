"""Light types in the order of their numbers: emissive surfaces, lights at a place, distant lights, the sky.

The kernel file of a type is light/<name>.cl, except for the sky, whose file pack_sky chooses. The kernels' infinite
lights are the last ones.
"""

from __future__ import annotations

from ....scene.lights import LIGHTS

SURFACES = ("triangle", "sphere")
LIGHT_KERNELS = tuple(name for kind in sorted(LIGHTS, key=lambda kind: kind.distant) for name in kind.kernels())
TYPES = (*SURFACES, *LIGHT_KERNELS, "sky")

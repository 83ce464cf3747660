"""Rays of many cameras as their kernel file generates them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.bench.kernel_probe import choices
from clrt.device.launches.device_arrays import empty_array, on_device
from clrt.device.launches.launch import run_kernel
from clrt.device.open import Device
from clrt.device.programs.program import build, make_kernel
from clrt.rendering.compile.camera_kernel import launch_record
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.model import Camera, Scene, Sphere

Doubles = NDArray[np.float64]

#: in: sx, sy -> out: direction (3), and whether there is a ray. One camera per work-item.
KERNEL = """
kernel void lens_rays(global const Launch *launches, uint n, uint per_camera, global const float *in,
                      global float *out) {
    uint own = (uint)get_global_id(0);
    if (own * LANES >= n) return;
    Launch launch = launches[own * LANES / per_camera];
    RealLanes sx, sy, x, y, z, found;
    for (int i = 0; i < LANES; ++i) {
        sx.lane[i] = in[own * LANES + i];
        sy.lane[i] = in[n + own * LANES + i];
    }
    Sampler sampler;
    CameraRay ray;
    found.all = ray_through(&launch, sx.all, sy.all, &sampler, &ray) ? ONE : ZERO;
    x.all = ray.direction.x;
    y.all = ray.direction.y;
    z.all = ray.direction.z;
    for (int i = 0; i < LANES; ++i) {
        out[own * LANES + i] = x.lane[i];
        out[n + own * LANES + i] = y.lane[i];
        out[2 * n + own * LANES + i] = z.lane[i];
        out[3 * n + own * LANES + i] = found.lane[i];
    }
}
"""


def rays(
    device: Device, cameras: Sequence[Camera], size: tuple[int, int], pixels: Doubles, **chosen: Any
) -> tuple[Doubles, NDArray[np.bool_]]:
    """Return directions (cameras, k, 3) through pixels (cameras, k, 2), and which have a ray. All cameras have the same
    kernel file, and k is a multiple of the lanes; the center of the upper left pixel is (0.5, 0.5)."""
    compiled = compile_scene(Scene(spheres=[Sphere()], camera=cameras[0]), choices(device, **chosen))
    program = build(device, compiled.source + KERNEL)
    launches = np.concatenate([launch_record(camera, size) for camera in cameras])
    count, per_camera, _ = pixels.shape
    n = count * per_camera
    places = (2 * pixels.reshape(n, 2) / size - 1).T.astype(np.float32)
    answer = empty_array(device, np.float32, 4 * n)
    kernel = make_kernel(device, program, "lens_rays")
    inputs = [on_device(device, np.ascontiguousarray(each)) for each in (launches, places)]
    kernel.set_args(inputs[0], np.uint32(n), np.uint32(per_camera), inputs[1], answer.buffer)
    run_kernel(device, kernel, -(-n // (compiled.choices.lanes * device.local_size)))
    found = answer.read(device).reshape(4, count, per_camera)
    return np.moveaxis(found[:3], 0, -1).astype(np.float64), found[3] != 0

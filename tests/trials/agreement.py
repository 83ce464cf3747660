"""Materials beside Mitsuba: a sphere of each on a diffuse floor, as `clrt bench agree` compares scenes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clrt.bench.renderers.agreement import agreement
from clrt.cli.bench_agree import HEAD, agreement_line
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import BlinnPhong, Dielectric, Diffuse, MetallicRoughness, Phong, Principled
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere

SIZE, SPP, SEEDS = (64, 64), 16, 12
MATERIALS: dict[str, Material] = {
    "specular": MetallicRoughness(color=(0.6, 0.3, 0.2), roughness=0.4, specular=0.6, specular_color=(1.5, 1.0, 0.5)),
    "schlick_ibl": MetallicRoughness(
        color=(0.8, 0.6, 0.3),
        roughness=0.6,
        metallic=0.3,
        smith="schlick_ibl",
        coupling="half_vector",
        multiple_scattering=True,
    ),
    "transmission": MetallicRoughness(color=(0.9, 0.8, 0.7), roughness=0.4, transmission=0.8),
    "layers": MetallicRoughness(
        color=(0.9, 0.8, 0.7),
        roughness=0.5,
        transmission=0.6,
        clearcoat=0.8,
        specular=0.8,
        clearcoat_roughness=0.2,
        sheen_color=(0.5, 0.3, 0.2),
        sheen_roughness=0.4,
    ),
    "rough glass": Dielectric(ior=1.5, roughness=0.7),
    "one bounce": Dielectric(ior=1.5, roughness=0.7, multiple_scattering=False),
    "thin": Dielectric(ior=1.5, roughness=0.5, thin=True, color=(0.9, 0.7, 0.5)),
    "phong": Phong(color=(0.6, 0.4, 0.3), specular=(0.5, 0.4, 0.3), shininess=30),
    "blinn_phong": BlinnPhong(color=(0.6, 0.4, 0.3), specular=(0.5, 0.4, 0.3), shininess=60),
    "principled": Principled(color=(0.8, 0.5, 0.2), metallic=0.4, roughness=0.4, spec_tint=0.5),
    "principled, sheen": Principled(color=(0.7, 0.4, 0.3), roughness=0.7, sheen=1.0, sheen_tint=0.5, flatness=0.5),
    "principled, clearcoat": Principled(color=(0.6, 0.2, 0.1), clearcoat=1.0, clearcoat_gloss=0.5),
    "principled, glass": Principled(color=(0.9, 0.8, 0.6), roughness=0.4, spec_trans=1.0),
    "principled, all": Principled(
        color=(0.8, 0.6, 0.3),
        metallic=0.2,
        roughness=0.5,
        ior=1.3,
        spec_tint=0.3,
        spec_trans=0.6,
        sheen=0.5,
        sheen_tint=0.3,
        flatness=0.3,
        clearcoat=0.8,
        clearcoat_gloss=0.2,
    ),
}


def trial() -> Iterator[str]:
    """Yield a table of the materials. It needs `pip install mitsuba`."""
    yield from HEAD
    for name, material in MATERIALS.items():
        yield agreement_line(agreement(ball(name, material), SPP, SEEDS))


def ball(name: str, material: Material) -> Scene:
    """Return a sphere of the material below a constant sky and a spherical area light."""
    floor = Mesh(
        np.array([[-6, 0, -6], [-6, 0, 6], [6, 0, 6], [6, 0, -6]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        Diffuse(color=(0.6, 0.5, 0.4)),
    )
    lamp = Diffuse(color=(0.0, 0.0, 0.0), emission=(8.0, 7.0, 6.0))
    return Scene(
        meshes=[floor],
        spheres=[
            Sphere(center=(0.0, 0.8, 0.0), radius=0.8, material=material),
            Sphere(center=(2.0, 3.0, 1.5), radius=0.4, material=lamp),
        ],
        camera=Camera(position=(0.0, 1.2, 4.0), look_at=(0.0, 0.7, 0.0), fov_degrees=40.0),
        environment=Environment(color=(0.5, 0.6, 0.8)),
        render=RenderSettings(size=SIZE),
        name=name,
    )

"""Size, samples, filter and path depth of a pbrt file."""

from __future__ import annotations

from ...scene.model import RenderSettings
from ...scene.render_settings import Filter, Integrator
from ..scene_parts.notes import Notes
from .description import Description
from .entities import Entity

#: pbrt's filters with their default radii, by clrt's; those of others are similar.
FILTERS: dict[str, Filter] = {
    "box": "box",
    "gaussian": "gaussian",
    "triangle": "tent",
    "mitchell": "gaussian",
    "sinc": "gaussian",
    "": "gaussian",
}
INTEGRATORS: dict[str, Integrator] = {
    **dict.fromkeys(
        ("path", "volpath", "bdpt", "mlt", "sppm", "simplepath", "simplevolpath", "lightpath", "randomwalk", ""), "path"
    ),
    "directlighting": "direct",
    "whitted": "path",
    "igi": "path",
    "irradiancecache": "path",
    "photonmap": "path",
    "exphotonmap": "path",
    "metropolis": "path",
}
#: The largest path depth.
MOST_DEPTH = 1024


def exposure(description: Description) -> float:
    """Return the factor by which the film and the shutter scale light."""
    film, camera = description.entity("Film"), description.entity("Camera")
    if description.old:
        return film.number("scale", 1.0)
    seconds = camera.number("shutterclose", 1.0) - camera.number("shutteropen", 0.0)
    if not seconds > 0:
        raise camera.fault("shutterclose", "is not after shutteropen", "write a later time")
    return seconds * film.number("iso", 100.0) / 100


def settings_of(description: Description, notes: Notes) -> RenderSettings:
    """Return the settings."""
    film, sampler = description.entity("Film"), description.entity("Sampler")
    default = (640, 480) if description.old else (1280, 720)
    size = tuple(film.integer(name, value) for name, value in zip(("xresolution", "yresolution"), default))
    _film(film, notes)
    kind, depth = _integrator(description.entity("Integrator"), notes)
    return RenderSettings(
        size=(size[0], size[1]),
        spp=_samples(sampler),
        filter=_filter(description.entity("PixelFilter"), notes),
        integrator=kind,
        max_depth=min(max(depth + 1, 1), MOST_DEPTH),
    )


def _film(film: Entity, notes: Notes) -> None:
    sensor = film.string("sensor", "cie1931")
    if sensor != "cie1931":
        notes.differ(film, f'the sensor "{sensor}" has the colors of the CIE 1931 observer')
    elif film.number("whitebalance", 0.0):
        notes.differ(film, "whitebalance is left out")
    for name, whole in (("cropwindow", [0, 1, 0, 1]), ("pixelbounds", None)):
        window = film.rows(name, 4, "float", "integer")
        if window is not None and window.tolist() != [whole]:
            notes.instead(film, f"{name} is not supported", "leave it out", "the whole image is rendered", name)
    film.ignore()  # the others affect how the image is stored


def _samples(sampler: Entity) -> int:
    if sampler.kind == "stratified":
        count = sampler.integer("xsamples", 4) * sampler.integer("ysamples", 4)
    else:
        count = sampler.integer("pixelsamples", 16)
    sampler.ignore()
    return max(count, 1)


def _filter(entity: Entity, notes: Notes) -> Filter:
    entity.ignore()
    if entity.kind not in FILTERS or entity.kind in ("mitchell", "sinc"):
        notes.differ(entity, f'a Gaussian filter instead of "{entity.kind}"')
    return FILTERS.get(entity.kind, "gaussian")


def _integrator(entity: Entity, notes: Notes) -> tuple[Integrator, int]:
    depth = entity.integer("maxdepth", 5)
    entity.ignore()  # the others affect how the image is computed
    if entity.kind not in INTEGRATORS:
        what = f'integrator "{entity.kind}" is not supported'
        notes.instead(entity, what, "use path, volpath, bdpt or directlighting", "path is used")
    return INTEGRATORS.get(entity.kind, "path"), depth

"""KHR_materials_pbrSpecularGlossiness as a metallic-roughness material that reflects the same.

The specular color is F0 of a dielectric: glTF's `ior` of 0, for which F0 is KHR_materials_specular's color, as the
specification of KHR_materials_ior recommends.
"""

from __future__ import annotations

import numpy as np

from ...scene.materials.textures import Picture
from . import material_schema as looks


def converted(source: looks.Material) -> looks.Material:
    """Return the material with diffuse color, F0 and roughness, except for its texture, in the places of glTF's own."""
    old = source.extensions.KHR_materials_pbrSpecularGlossiness
    if old is None:
        return source
    pbr = looks.Pbr(
        baseColorFactor=old.diffuseFactor,
        baseColorTexture=old.diffuseTexture,
        metallicFactor=0.0,
        roughnessFactor=1 - min(max(old.glossinessFactor, 0.0), 1.0),
    )
    specular = looks.Specular(
        specularColorFactor=old.specularFactor, specularColorTexture=old.specularGlossinessTexture
    )
    extensions = source.extensions.model_copy(
        update={"KHR_materials_specular": specular, "KHR_materials_ior": looks.Ior(ior=0.0)}
    )
    return source.model_copy(update={"pbrMetallicRoughness": pbr, "extensions": extensions})


def rough_picture(picture: Picture, glossiness: float) -> Picture:
    """Return the roughness, 1 minus the factor times the image's alpha, as an image's green channel."""
    texels = picture.texels.copy()
    texels[..., 1] = np.rint(255 - min(max(glossiness, 0.0), 1.0) * texels[..., 3].astype(np.float64))
    return Picture(texels, picture.name)

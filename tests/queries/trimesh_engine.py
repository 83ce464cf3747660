"""Makes trimesh's own tests use clrt in place of both of its engines. In the folder tests of its source:

PYTHONPATH=CLRT/tests python -m pytest -p trimesh_engine test_ray.py test_ray_upstream.py
"""

from __future__ import annotations

import trimesh
import trimesh.ray.ray_pyembree

import clrt.trimesh

for module in (trimesh.ray.ray_triangle, trimesh.ray.ray_pyembree):
    setattr(module, "RayMeshIntersector", clrt.trimesh.RayMeshIntersector)

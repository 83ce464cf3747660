"""Transforms, normals, tangents, and checked arrays of meshes and rays."""

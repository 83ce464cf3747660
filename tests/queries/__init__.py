"""Tests of clrt.queries and clrt.trimesh."""

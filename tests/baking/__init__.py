"""Tests of clrt.baking."""

"""Tests of clrt.debug."""

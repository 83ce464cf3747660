"""Tests of clrt.formats."""

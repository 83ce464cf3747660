"""Tests of clrt.check."""

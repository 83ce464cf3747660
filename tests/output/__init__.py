"""Tests of clrt.output."""

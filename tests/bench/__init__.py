"""Tests of clrt.bench."""

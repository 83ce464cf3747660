"""Tests of clrt, laid out like its rooms."""

"""Tests of clrt, laid out like its packages."""

"""Tests of clrt.scene."""

"""Workarounds for PoCL: processor names, damaged caches, a missing linker."""

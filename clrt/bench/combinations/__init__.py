"""Identities that pictures of random scenes obey."""

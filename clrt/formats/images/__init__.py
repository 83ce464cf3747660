"""Image files, decoded in a process of its own where a decoder may crash."""

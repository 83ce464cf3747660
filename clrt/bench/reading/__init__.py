"""Speed and memory of reading model files, by clrt and by other programs."""

"""Error by samples and by time, against references, and whether its estimate is right."""

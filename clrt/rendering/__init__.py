"""How it is drawn: a scene packed into buffers and a program, launches, accumulation, noise."""

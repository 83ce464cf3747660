"""Path tracing of single pixels with every vertex recorded: the answer to "why is it black?"."""

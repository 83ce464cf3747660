"""Scene description: the scene's dataclasses, the scene file and the model readers. Numpy only, no OpenCL."""

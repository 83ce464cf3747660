"""Reference path tracer (oracle) in float64 numpy that shares no code with the kernels.

Brute force instead of the renderer's optimizations: every ray is tested against every primitive, emitters and
environment are found by BSDF sampling alone, delta lights are summed at every path vertex, and there is no light
selection. Materials are written from the publications that they cite.
"""

"""An oracle for pictures: a small path tracer in float64 numpy that shares no code with the kernels.

Brute force where the renderer is clever: every ray is tested against every primitive, emitters and skies are found by
BSDF sampling alone, delta lights are summed at every path vertex, nothing is chosen by importance. Materials are
written from the publications that they name.
"""

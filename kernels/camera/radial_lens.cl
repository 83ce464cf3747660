// The radial part of a lens's distortion: a direction at the radius r, the tangent of its angle from the optical axis or
// the angle itself, is imaged at g(r) = r·N(r²)/D(r²) from the axis, N and D being polynomials that begin with 1
// (clrt/scene/lens_model.py). g increases up to launch->reach, beyond which no direction has a ray.
#include "core/vector.cl"

#define RADIAL_STEPS 16     // from the first estimate; clrt's tests find what is needed
#define POLISHING_STEPS 4   // the last of them, which no longer bisect
#define RESIDUAL 1e-5f      // that a solution may have, relative to 1 + g

// Position on the image plane at distance 1, x to the right, y down, of the image position (sx, sy).
static inline real2 on_plane(const Launch *launch, real sx, real sy) {
    return (real2){sx * launch->across[0] + sy * launch->across[1] + launch->across[2],
                   sx * launch->down[0] + sy * launch->down[1] + launch->down[2]};
}

// Return N/D at the square of a radius; slope: its derivative by the square. Neither N·D nor D² is computed, which
// could overflow.
static inline real radial_factor(const Launch *launch, real square, real *slope) {
    const float *n = launch->numerator, *d = launch->denominator;
    real above = 1.0f + square * (n[0] + square * (n[1] + square * (n[2] + square * n[3])));
    real below = 1.0f / (1.0f + square * (d[0] + square * (d[1] + square * d[2])));
    real above_slope = n[0] + square * (2.0f * n[1] + square * (3.0f * n[2] + square * (4.0f * n[3])));
    real below_slope = d[0] + square * (2.0f * d[1] + square * (3.0f * d[2]));
    real factor = above * below;
    *slope = (above_slope - factor * below_slope) * below;
    return factor;
}

// Return the radius, at most launch->reach, with g(radius) = `imaged`: Newton's method in an interval that contains it,
// which is halved where a step would leave it. residual: g(radius) − imaged.
static inline real undistorted_radius(const Launch *launch, real imaged, real *residual) {
    real low = ZERO, high = (real)(launch->reach), radius = minimum(imaged, high), slope;
    for (int step = 0; step < RADIAL_STEPS; ++step) {
        real factor = radial_factor(launch, square(radius), &slope);
        real over = radius * factor - imaged;
        low = over < 0.0f ? radius : low;
        high = over < 0.0f ? high : radius;
        real next = radius - over / (factor + 2.0f * square(radius) * slope);
        ireal kept = (next >= low) & (next <= high);
        real otherwise = step < RADIAL_STEPS - POLISHING_STEPS ? 0.5f * (low + high) : radius;
        radius = kept ? next : otherwise;
    }
    *residual = radius * radial_factor(launch, square(radius), &slope) - imaged;
    return radius;
}

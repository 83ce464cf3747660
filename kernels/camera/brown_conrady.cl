// Inverse of Brown and Conrady's distortion with a rational radial part, as OpenCV defines it (clrt/scene/lens_model.py).
#include "camera/radial_lens.cl"

#define TANGENTIAL_STEPS 8

// Compute which position on the image plane at distance 1, x to the right, y down, a pinhole would have instead of the
// image position (sx, sy): Newton's method in the plane, from the inverse of the radial part. Returns the lanes where
// it converges and the distortion does not fold.
static inline ireal undistorted(const Launch *launch, real sx, real sy, real2 *place) {
    real2 at = on_plane(launch, sx, sy);
    real imaged = sqrt(square(at.x) + square(at.y)), residual;
    real along = undistorted_radius(launch, imaged, &residual);
    // The tangential part may image a point at a greater distance than the radial part images any.
    along = absolute(residual) > RESIDUAL * (1.0f + imaged) ? (real)(0.9f * launch->reach) : along;
    along = imaged > 0.0f ? along / imaged : ONE;
    real x = at.x * along, y = at.y * along, p1 = (real)(launch->p1), p2 = (real)(launch->p2), determinant = ONE;
    for (int step = 0; step < TANGENTIAL_STEPS; ++step) {
        real slope, radius2 = square(x) + square(y), factor = radial_factor(launch, radius2, &slope);
        real over_x = x * factor + 2.0f * p1 * x * y + p2 * (radius2 + 2.0f * square(x)) - at.x;
        real over_y = y * factor + p1 * (radius2 + 2.0f * square(y)) + 2.0f * p2 * x * y - at.y;
        // The Jacobian matrix, which is symmetric.
        real xx = factor + 2.0f * square(x) * slope + 2.0f * p1 * y + 6.0f * p2 * x;
        real xy = 2.0f * x * y * slope + 2.0f * p1 * x + 2.0f * p2 * y;
        real yy = factor + 2.0f * square(y) * slope + 6.0f * p1 * y + 2.0f * p2 * x;
        determinant = xx * yy - xy * xy;
        x -= (yy * over_x - xy * over_y) / determinant;
        y -= (xx * over_y - xy * over_x) / determinant;
        residual = maximum(absolute(over_x), absolute(over_y));
    }
    ireal found = (residual <= RESIDUAL * (1.0f + imaged)) & (determinant > 0.0f) &
                  (square(x) + square(y) <= 1.0001f * square(launch->reach));
    *place = (real2){found ? x : ZERO, found ? y : ZERO};
    return found;
}

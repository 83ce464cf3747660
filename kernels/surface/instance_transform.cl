// Instance transforms: from a mesh's object frame to the world.
//
// Normals are transformed by the cofactors of the matrix M, its inverse transpose up to a factor; for a mirroring M
// they are flipped, so that a mesh keeps its front. The error of a point is that in the object frame plus the rounding
// of the transforms to the object frame, where rays are intersected, and back: some ulps of |M|·|M^-1|·(|p| + |moved|)
// (pbrt, 4th ed., 6.8.6), which is large if M shears. Instance 0 is the geometry without instancing, if there is any;
// its matrix is the identity.

typedef struct {
    real3 x, y, z, moved;            // rows of M, and its translation
    real3 normal_x, normal_y, normal_z;
    real unit, side;                 // no entry of unit·M exceeds 1; side: 1, or −1 if M mirrors
} Place;

static inline real3 placed_normal(const Place *place, real3 n) {
    real3 world = vector(dot3(place->normal_x, n), dot3(place->normal_y, n), dot3(place->normal_z, n));
    return scale(normalize3(world), place->side);
}

#if MOTION
// Set the matrices of the lanes whose instances move; motion: their numbers, or −1.
static inline void place_moving(const Scene *scene, ireal motion, Place *place) {
    RealLanes rows[3][4] = {{{place->x.x}, {place->x.y}, {place->x.z}, {place->moved.x}},
                            {{place->y.x}, {place->y.y}, {place->y.z}, {place->moved.y}},
                            {{place->z.x}, {place->z.y}, {place->z.z}, {place->moved.z}}};
    for (int lane = 0; lane < LANES; ++lane) {
        int number = LANE_INT(motion, lane);
        if (number < 0) continue;
        float pose[3][4];
        pose_at(RECORD(scene->motions, number), LANE(scene->time, lane), pose);
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) rows[row][column].lane[lane] = pose[row][column];
    }
    place->x = vector(rows[0][0].all, rows[0][1].all, rows[0][2].all);
    place->y = vector(rows[1][0].all, rows[1][1].all, rows[1][2].all);
    place->z = vector(rows[2][0].all, rows[2][1].all, rows[2][2].all);
    place->moved = vector(rows[0][3].all, rows[1][3].all, rows[2][3].all);
}
#endif

static inline Place place_of(const Scene *scene, ireal instance) {
    Place place;
    place.x = GATHER3(scene->placements, instance, .to_world[0]);
    place.y = GATHER3(scene->placements, instance, .to_world[1]);
    place.z = GATHER3(scene->placements, instance, .to_world[2]);
    place.moved = vector(GATHER(real, scene->placements, instance, .to_world[0][3]),
                         GATHER(real, scene->placements, instance, .to_world[1][3]),
                         GATHER(real, scene->placements, instance, .to_world[2][3]));
#if MOTION
    place_moving(scene, GATHER(ireal, scene->motion_of, instance, .motion), &place);
#endif
    real unit = GATHER(real, scene->placements, instance, .unit);
    place.unit = absolute(unit);
    // Products of M's own entries could overflow or underflow.
    real3 x = scale(place.x, unit), y = scale(place.y, unit), z = scale(place.z, unit);
    place.normal_x = cross3(y, z);
    place.normal_y = cross3(z, x);
    place.normal_z = cross3(x, y);
    place.side = unit < 0.0f ? (real)(-1.0f) : ONE;
    return place;
}

static inline real3 placed_vector(const Place *place, real3 v) {
    return vector(dot3(place->x, v), dot3(place->y, v), dot3(place->z, v));
}

// A mesh's tangent in the world, of unit length; zero stays zero.
static inline real3 placed_tangent(const Place *place, real3 t) {
    real3 world = scale(vector(dot3(place->x, t), dot3(place->y, t), dot3(place->z, t)), place->unit);
    real norm2 = dot3(world, world);
    return scale(world, norm2 > 0.0f ? rsqrt(norm2) : ZERO);
}

// Transform the point with its error bound, and the geometric normal.
static inline void place_surface(const Scene *scene, ireal instance, const Place *place, Surface *surface) {
    real3 p = surface->p, error = surface->p_error;
    surface->p = add(vector(dot3(place->x, p), dot3(place->y, p), dot3(place->z, p)), place->moved);
    real3 reach = add(absolute3(surface->p), absolute3(place->moved));
    surface->p_error = vector(
        dot3(absolute3(place->x), error) + dot3(GATHER3(scene->placements, instance, .rounding0), reach),
        dot3(absolute3(place->y), error) + dot3(GATHER3(scene->placements, instance, .rounding1), reach),
        dot3(absolute3(place->z), error) + dot3(GATHER3(scene->placements, instance, .rounding2), reach));
    surface->ng = placed_normal(place, surface->ng);
}

#define PLACED_NORMAL(n) placed_normal(&place, n)
#define PLACED_TANGENT(t) placed_tangent(&place, t)

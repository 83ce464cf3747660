// Normal maps, as in glTF: (x, y) from 0 to 1 encode −1 to 1, x along the tangent, y along the bitangent. Applied
// before the normals are turned towards the viewer.
//
// COAT_NORMALS: a coat uses the unbent normal or a normal map of its own. Material types with such coats are evaluated
// in the frame of the unbent normal, in which the normals of coat and base are two directions (bsdf/layers.cl).

// Each lane's normal map: its texture, −1 for none, and its scale.
typedef struct { ireal texture; real strength; } NormalMap;

#define READ_MAP(map, name, number) { \
        ireal is_type = (surface->material & 15) == number; \
        ireal index = is_type ? surface->material >> 4 : (ireal)(0); \
        found.texture = is_type ? GATHER(ireal, scene->name, index, .map##_texture) : found.texture; \
        found.strength = is_type ? GATHER(real, scene->name, index, .map) : found.strength; \
    }

static inline NormalMap normal_map(const Scene *scene, const Surface *surface) {
    NormalMap found = {(ireal)(-1), ONE};
#define NORMAL_MAP(name, number) READ_MAP(normal_map, name, number)
    NORMAL_MAPPED_TYPES(NORMAL_MAP)
    return found;
}

#if COAT_NORMALS
static inline NormalMap coat_normal_map(const Scene *scene, const Surface *surface) {
    NormalMap found = {(ireal)(-1), ONE};
#define COAT_NORMAL_MAP(name, number) READ_MAP(clearcoat_normal_map, name, number)
    COAT_MAPPED_TYPES(COAT_NORMAL_MAP)
    return found;
}
#endif

#if SPHERES
// The tangent of a sphere and its handedness follow the texture transform of the image. On a sphere u runs east, one
// turn per unit, and v south, half a turn per unit.
static inline void place_sphere_tangent(const Scene *scene, ireal texture, real3 n, real3 *tangent, real *handedness) {
    real3 u_row = GATHER3(scene->textures, texture, .u_row), v_row = GATHER3(scene->textures, texture, .v_row);
    real side = u_row.x * v_row.y - u_row.y * v_row.x < 0.0f ? -ONE : ONE;
    real3 east = *tangent, north = cross3(n, normalize3(east));
    ireal is_sphere = *handedness == 2.0f;
    *tangent = choose(is_sphere, scale(mad3(east, 2.0f * v_row.y, scale(north, v_row.x)), side), *tangent);
    *handedness = is_sphere ? side : *handedness;
}
#endif

static inline real3 bent(const Scene *scene, const Surface *surface, NormalMap map) {
    ireal mapped = (map.texture >= 0) & (surface->handedness != 0.0f);
    if (!ANY(mapped)) return surface->ns;
    Footprint found = footprint(scene, mapped ? map.texture : (ireal)(0), &surface->at);
    real x = (2.0f * filtered(&found, (ureal)(0)) - 1.0f) * map.strength;
    real y = (2.0f * filtered(&found, (ureal)(8)) - 1.0f) * map.strength;
    real z = 2.0f * filtered(&found, (ureal)(16)) - 1.0f;
    real3 n = surface->ns, along = surface->tangent;
    real handedness = surface->handedness;
#if SPHERES
    place_sphere_tangent(scene, mapped ? map.texture : (ireal)(0), n, &along, &handedness);
#endif
    real3 t = normalize3(sub(along, scale(n, dot3(along, n))));
    real3 b = scale(cross3(n, t), handedness);
    real3 turned = mad3(t, x, mad3(b, y, scale(n, z)));
    real norm2 = dot3(turned, turned);
    return choose(mapped & (norm2 > 0.0f), scale(turned, rsqrt(norm2)), n);
}

static inline void bend_normal(const Scene *scene, Surface *surface) {
#if COAT_NORMALS
    surface->coat_normal = bent(scene, surface, coat_normal_map(scene, surface));
#endif
    surface->ns = bent(scene, surface, normal_map(scene, surface));
}

// Bump shadowing of diffuse light to or from w, unit, world frame: without it light would end at a hard edge where w
// sinks below the surface. GGX shadowing with a roughness derived from the bump's slope (Estevez, Lecocq and Stein
// 2019, A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem): 1 without a map, 0 at the horizon.
static inline real bump_shadowing(const Surface *surface, real3 w) {
    real up = dot3(w, surface->unbent), bend = dot3(surface->ns, surface->unbent), up2 = up * up, bend2 = bend * bend;
    real alpha2 = minimum(0.125f * maximum(1.0f - bend2, ZERO) / bend2, ONE);
    return up > 0.0f ? 2.0f * up / (up + sqrt(up2 + alpha2 * maximum(1.0f - up2, ZERO))) : ZERO;
}

#if COAT_NORMALS
// The normal of the frame in which a material is evaluated.
static inline real3 frame_normal(const Surface *surface) {
    real3 n = surface->ns;
#define UNBENT(name, number) n = choose((surface->material & 15) == number, surface->unbent, n);
    COATED_TYPES(UNBENT)
    return n;
}
#endif

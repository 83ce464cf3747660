// Multiple-scattering compensation of rough glass (clrt/scene/materials/dielectric_energy.py); the energy that a
// single bounce loses is returned by:
//   f·|cos wi| over 1 − min(loss(wo), loss(wi)), and rest(wo)·rest(wi)·|cos wi|/(pi·m)·share
// with m = Σ n²·∫ rest·2c dc over n² of wo's side, and share = n² of wi's side over that of wo's; for a thin sheet, the
// mean rest and the part that leaves on wi's side. Both are reciprocal, and at every angle all light is reflected or
// transmitted. Transmitted light is multiplied by `color`, as after a single bounce.
//
// The table has a row per roughness, each with the outside and then the inside: ENERGY_STEPS + 1 pairs (loss, rest),
// and a pair (m over the mean of grazing²/(grazing² + c²), the fraction of all rest that leaves on this side).
#define ENERGY_STEPS 96
#define ENERGY_SIDE (2 * (ENERGY_STEPS + 2))
#define ENERGY_ROWS ((int)(sizeof(((Dielectric *)0)->energy) / sizeof(float)) / (2 * ENERGY_SIDE))

typedef struct { real first, second; } Pair;

static inline ireal table_index(real place, int last) {
    ireal index = TO_INT(place);
    return index > 0 ? (index < last ? index : (ireal)(last)) : (ireal)(0);    // arbitrary in inactive lanes
}

// Interpolate linearly in a side's table at `place`, in pairs from its beginning.
static inline Pair pair_at(const struct dielectric *m, ireal inside, real place) {
    ireal pair = table_index(place, ENERGY_STEPS), row = table_index(m->row, ENERGY_ROWS > 1 ? ENERGY_ROWS - 2 : 0);
    ireal first = (2 * row + (inside ? (ireal)(1) : (ireal)(0))) * ENERGY_SIDE + 2 * pair;
    real across = place - TO_REAL(pair), down = m->row - TO_REAL(row);
    RealLanes loss, rest;
    for (int lane = 0; lane < LANES; ++lane) {
        global const float *entry = RECORD(m->scene->dielectric, LANE_INT(m->index, lane))->energy + LANE_INT(first, lane);
        float4 pairs = vload4(0, entry);
        if (ENERGY_ROWS > 1) pairs = mix(pairs, vload4(0, entry + 2 * ENERGY_SIDE), LANE(down, lane));
        float2 between = mix(pairs.lo, pairs.hi, LANE(across, lane));
        loss.lane[lane] = between.x;
        rest.lane[lane] = between.y;
    }
    return (Pair){loss.all, rest.all};
}

// The fraction of light from this angle that the single bounce loses, and what remains missing after its division.
static inline Pair lost_from(const struct dielectric *m, ireal inside, real cosine) {
    real width = 4.0f * m->grazing;
    return pair_at(m, inside, (float)ENERGY_STEPS * sqrt(cosine / (cosine + width) * (1.0f + width)));
}

// Multiple scattering is sampled with a density proportional to 1/(cos² + grazing²) in cos², which approximates `rest`:
// cos/(pi·range·(cos² + grazing²)), range = log(1 + 1/grazing²).
static inline real3 sample_later(const struct dielectric *m, real2 u) {
    real z2 = minimum(m->grazing * m->grazing * (exp(u.x * m->range) - 1.0f), ONE);
    real s, c, r = sqrt(1.0f - z2);
    sincos_turns(u.y, &s, &c);
    return vector(r * c, r * s, sqrt(z2));
}

static inline real later_pdf(const struct dielectric *m, real cosine) {
    return cosine / (PI * m->range * (cosine * cosine + m->grazing * m->grazing));
}

// Set the terms of multiple scattering that depend on wo's side only, given alpha and the row of the table.
static inline void read_later(struct dielectric *m, real ior) {
    m->grazing = IS_THIN(m) ? m->alpha : minimum(m->alpha, sqrt(m->alpha * absolute(ior - 1.0f / ior)));
    m->range = log(1.0f + 1.0f / (m->grazing * m->grazing));
    Pair all = pair_at(m, m->inside, (real)(ENERGY_STEPS + 1));
    m->later = 1.0f / maximum(PI * m->grazing * m->grazing * m->range * all.first, (real)(1e-30f));
    m->returned = all.second;
}

// Whether paths can be trapped for long: inside rough glass. There a single bounce weighs up to 1/(1 − loss) while
// failed samples weigh nothing, and over many bounces the variance grows without bound. So samples that a microfacet
// sends to the wrong side of the surface are folded back, and multiple scattering is sampled more often than its share.
// (`returned` is 0 if the material uses single bounces only.)
static inline ireal keeps_light(const struct dielectric *m) {
    return (m->alpha > 0.1f) & (m->eta < 1.0f) & (m->returned > 0.0f) & !IS_THIN(m);
}

static inline real later_chance(const struct dielectric *m, Pair from) {
    return keeps_light(m) ? mix(from.second, from.first, m->alpha) : from.second;
}

// The pdf of wi over all bounces, from the pdf of single-bounce samples; *value likewise.
static inline real all_bounces(const struct dielectric *m, real3 wo, real3 wi, real pdf, real3 *value) {
    ireal reflected = wi.z > 0.0f, scatters = (m->alpha > 0.0f) & (wo.z > 0.0f);
    real cosine = absolute(wi.z), part = reflected ? m->returned : 1.0f - m->returned;
    Pair from = lost_from(m, m->inside, wo.z), to = lost_from(m, reflected ? m->inside : !m->inside, cosine);
    // A thin sheet splits diffuse light with a mean Fresnel term f for which it reflects 2f/(1 + f).
    Division d = divide_light(m, m->returned / (2.0f - m->returned));
    real share = IS_THIN(m) ? part : (reflected ? ONE : m->eta * m->eta);
    real3 later = scale(choose(reflected, d.reflection, d.transmission), from.second * to.second * cosine * share * m->later);
    *value = choose(scatters, mad3(*value, 1.0f / (1.0f - minimum(from.first, to.first)), later), splat(ZERO));
    real chance = later_chance(m, from);
    return scatters ? (1.0f - chance) * pdf + chance * part * later_pdf(m, cosine) : ZERO;
}

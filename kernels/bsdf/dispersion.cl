// Dispersion of smooth glass, as in glTF's KHR_materials_dispersion: an index of refraction for each channel.
//
// All channels are reflected along one direction, with the probability of their mean F and the weights F/mean F. A
// refracted path goes on with one channel, chosen with a probability proportional to 1 − F, whose weight is 3: that
// over its probability. A path that has one channel left keeps it.

static inline real of_channel(real3 values, ireal channel) {
    return channel == 0 ? values.x : (channel == 1 ? values.y : values.z);
}

static inline Dispersion dispersion_at(real ior, real dispersion, const Surface *surface) {
    real spread = (ior - 1.0f) * 0.025f * dispersion;
    real3 iors = vector(ior - spread, ior, ior + spread), beta = surface->throughput;
    iors.x = ior >= 1.0f ? maximum(iors.x, ONE) : iors.x;
    Dispersion d;
    d.etas = choose(surface->front, iors, vector(1.0f / iors.x, 1.0f / iors.y, 1.0f / iors.z));
    ireal red = beta.x > 0.0f, green = beta.y > 0.0f, blue = beta.z > 0.0f;
    d.channel = (ireal)(-1);
    d.channel = (red & !green & !blue) ? (ireal)(0) : d.channel;
    d.channel = (green & !red & !blue) ? (ireal)(1) : d.channel;
    d.channel = (blue & !red & !green) ? (ireal)(2) : d.channel;
    return d;
}

// Replace a sample where the channels separate.
static inline BsdfSample dispersed(const struct dielectric *m, real3 wo, real lobe, BsdfSample sample) {
    const Dispersion *d = &m->dispersion;
    ireal separate = (d->channel < 0) & (d->etas.x != d->etas.z);
    if (!ANY(separate)) return sample;
    real3 f, cos_t;
    f.x = fresnel_dielectric(wo.z, d->etas.x, &cos_t.x);
    f.y = fresnel_dielectric(wo.z, d->etas.y, &cos_t.y);
    f.z = fresnel_dielectric(wo.z, d->etas.z, &cos_t.z);
    real mean = (f.x + f.y + f.z) * (1.0f / 3.0f);
    ireal reflected = lobe < mean;
    real place = (lobe - mean) * 3.0f;     // below the sum of 1 − F
    ireal channel = place < 1.0f - f.x ? (ireal)(0) : (place < 2.0f - f.x - f.y ? (ireal)(1) : (ireal)(2));
    channel = ((channel == 2) & !(f.z < 1.0f)) ? (f.y < 1.0f ? (ireal)(1) : (ireal)(0)) : channel;      // by rounding
    real to_inside = 1.0f / of_channel(d->etas, channel);
    real3 bent = vector(-wo.x * to_inside, -wo.y * to_inside, -of_channel(cos_t, channel));
    real3 one = vector(channel == 0 ? ONE : ZERO, channel == 1 ? ONE : ZERO, channel == 2 ? ONE : ZERO);
    real3 weight = choose(reflected, scale(f, 1.0f / mean), scale(mul(one, m->color), (real)(3.0f)));
    BsdfSample own = sample;
    own.wi = choose(separate, choose(reflected, vector(-wo.x, -wo.y, wo.z), bent), sample.wi);
    own.weight = choose(separate, weight, sample.weight);
    own.spread = separate ? (reflected ? ONE : to_inside * to_inside) : sample.spread;
    return own;
}

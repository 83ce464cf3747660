// How far boxes are padded so that rounding loses none which the exact ray enters at t >= 0 (Ize 2013, "Robust BVH Ray
// Traversal", JCGT 2(2)). u = 2^-24.
//
// - SLAB_PAD, of t = (plane − origin)·(1/direction): three roundings, so a relative error below 3 u; twice that.
// - BOX_PAD, of t = plane·inverse + shift: the division costs 1 u of t, the sum 1 u of t, and the product in `shift` 1 u of
//   |shift|; 4 u of t and 4 u of |shift|.
// - STEEPEST: beyond it t is off, but for all planes of the axis alike, so only on which side of them the origin lies has a
//   meaning. SIDE pads that by 1e-8 lengths, so that an origin on a plane is on its inner side.
// - ORIGIN_PAD, of p − origin in compressed nodes: see traverse/cwbvh.cl.

#define SLAB_PAD (6.0f * 5.9604645e-8f)
#define ORIGIN_PAD (4.0f * 5.9604645e-8f)
#define BOX_PAD (4.0f * UNIT_ROUNDOFF)
#define STEEPEST 1e36f
#define SIDE 1e28f

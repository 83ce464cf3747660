// Box padding, so that rounding loses no box that the exact ray enters at t >= 0 (Ize 2013, "Robust BVH Ray Traversal",
// JCGT 2(2)). u = 2^-24.
//
// - SLAB_PAD, of t = (plane − origin)·(1/direction): three roundings, a relative error below 3 u; it is twice that.
// - BOX_PAD, of t = plane·inverse + shift: the division adds 1 u of t, the sum 1 u of t, and the product in `shift` 1 u
//   of |shift|; it is 4 u of t and 4 u of |shift|.
// - STEEPEST: beyond it t is wrong, but by the same amount for all planes of the axis, so only the side of them on which
//   the origin lies matters. SIDE pads that by 1e-8 lengths, so that an origin on a plane is on its inner side.
// - ORIGIN_PAD, of p − origin in compressed nodes: see traverse/cwbvh.cl.

#define SLAB_PAD (6.0f * 5.9604645e-8f)
#define ORIGIN_PAD (4.0f * 5.9604645e-8f)
#define BOX_PAD (4.0f * UNIT_ROUNDOFF)
#define STEEPEST 1e36f
#define SIDE 1e28f

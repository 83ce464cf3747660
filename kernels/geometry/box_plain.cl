// Textbook slab test, without padding: rounding makes rays miss boxes at their edges, and the primitives inside. With a
// zero component of the direction, t by inverse and shift is NaN, and all such planes count as entered.

#define SLAB_PAD 0.0f
#define ORIGIN_PAD 0.0f
#define BOX_PAD 0.0f
#define STEEPEST INFINITY
#define SIDE 0.0f

// Arrays of the scene. If one exceeds the device's largest buffer, all are split into parts and a record takes two
// lookups; each part repeats the first PART_OVERLAP records of the next, so that the records of a leaf are contiguous.
// Otherwise an array is a plain buffer, without overhead.
//
// RECORD(scene->name, i)         pointer to record i
// ARRAY(Type) name               parameter type of such an array
// WHOLE(Type, name, pointer);    an array of a single buffer, with at most as many records as a part has of its own

#if PART_BYTES
#define ARRAY(type) global const type *const *
#define WHOLE(type, name, pointer) global const type *const name[1] = {pointer}
#define PART_RECORDS(array) ((uint)(PART_BYTES / sizeof(**(array)) - PART_OVERLAP))
#define RECORD(array, i) ((array)[(uint)(i) / PART_RECORDS(array)] + (uint)(i) % PART_RECORDS(array))
#else
#define ARRAY(type) global const type *
#define WHOLE(type, name, pointer) global const type *name = pointer
#define RECORD(array, i) ((array) + (i))
#endif

// Arrays of the scene. Where one is larger than the device's largest buffer all are in parts, and a record is looked up in
// two steps; each part ends with the first PART_OVERLAP records of the next, so those of a leaf stand in one. Else an
// array is a buffer, and this costs nothing.
//
// RECORD(scene->name, i)         pointer to record i
// ARRAY(Type) name               how functions take such an array
// WHOLE(Type, name, pointer);    one of a single buffer, of at most as many records as a part has of its own

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

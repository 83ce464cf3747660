// Exclusive prefix sums of several arrays of `count` numbers, stored consecutively in `values`, in place.
//
// Each array is split into `parts`, one per work-group. If there are several, the sums of the parts are scanned in
// turn, and the sum before each part is added to it.
#define SCAN_ITEMS 256

kernel void scan(global uint *values, uint count, uint parts, global uint *totals) {
    local uint sums[SCAN_ITEMS];
    uint group = get_group_id(0), part = (count + parts - 1) / parts, start = group % parts * part;
    uint here = start < count ? (count - start < part ? count - start : part) : 0;
    uint me = get_local_id(0), items = get_local_size(0), share = (here + items - 1) / items;
    uint first = me * share < here ? me * share : here, end = first + share < here ? first + share : here;
    global uint *mine = values + group / parts * count + start;
    uint sum = 0;
    for (uint i = first; i < end; ++i) sum += mine[i];
    sums[me] = sum;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint before = 0;
    for (uint i = 0; i < me; ++i) before += sums[i];
    for (uint i = first; i < end; ++i) {
        uint value = mine[i];
        mine[i] = before;
        before += value;
    }
    if (me == items - 1) totals[group] = before;
}

// count: of all arrays together; `each`: of one array.
kernel void add_before(uint count, uint block, global uint *values, uint each, uint parts, global const uint *before) {
    uint first = (uint)get_global_id(0) * block, end = first + block < count ? first + block : count;
    uint part = (each + parts - 1) / parts;
    for (uint i = first; i < end; ++i) values[i] += before[i / each * parts + i % each / part];
}

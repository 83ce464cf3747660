// Exclusive prefix sums of several arrays of `count` numbers, one after another in `values`, in place: a work-group each.
#define SCAN_ITEMS 256

kernel void scan(global uint *values, uint count, global uint *totals) {
    local uint sums[SCAN_ITEMS];
    uint me = get_local_id(0), items = get_local_size(0), share = (count + items - 1) / items;
    uint first = me * share < count ? me * share : count, end = first + share < count ? first + share : count;
    global uint *mine = values + get_group_id(0) * count;
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
    if (me == items - 1) totals[get_group_id(0)] = before;
}

// Kernels whose work-groups each process a tile of `block` consecutive items.
#define TILE_ITEMS 64   // work-items per work-group, at most

// The tile's items first … end − 1; this work-item's index and the number of them; the index of the tile and the number
// of them.
#define TILE_RANGE \
    uint me = get_local_id(0), items = get_local_size(0), tile = (uint)get_global_id(0) / items; \
    uint tiles = (count + block - 1) / block, first = tile * block, end = first + block < count ? first + block : count;

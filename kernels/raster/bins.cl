// The picture's bins, in which primitives are sorted by where they are seen: tiles, squares of 8 x 8 tiles, and squares of
// 8 x 8 of these. A primitive is in those bins of one size that it touches, small ones in small bins, so that few bins hold
// it; what a tile sees is in the three bins around it.
//
// Starts are where each bin's entries begin, and behind the last bin's; entries are numbers of outlines.
#define BIN_LEVELS 3
#define BIN_SHIFT 3   // 2^3 along a side make one of the next size

typedef struct { uint across, down, first; } BinLevel;   // bins in a row, rows, and the first bin's number

static inline BinLevel bin_level(const Launch *launch, uint level) {
    BinLevel bins = {(launch->width + TILE - 1) / TILE, (launch->height + TILE - 1) / TILE, 0};
    for (uint i = 0; i < level; ++i) {
        bins.first += bins.across * bins.down;
        bins.across = (bins.across + (1 << BIN_SHIFT) - 1) >> BIN_SHIFT;
        bins.down = (bins.down + (1 << BIN_SHIFT) - 1) >> BIN_SHIFT;
    }
    return bins;
}

// The bins of the image, to which primitives are sorted by their screen bounds: tiles, squares of 8 x 8 tiles, and
// squares of 8 x 8 of these. A primitive is entered in the bins of one size that it overlaps, small primitives in small
// bins, so that few bins hold it; a tile's primitives are in the three bins around it.
//
// Starts are the offsets of the bins' entries, followed by the end of the last bin; entries are indices of outlines.
#define BIN_LEVELS 3
#define BIN_SHIFT 3   // 2^3 per side make one bin of the next size

typedef struct { uint across, down, first; } BinLevel;   // bins per row, rows, and the index of the first bin

static inline BinLevel bin_level(const Launch *launch, uint level) {
    BinLevel bins = {(launch->width + TILE - 1) / TILE, (launch->height + TILE - 1) / TILE, 0};
    for (uint i = 0; i < level; ++i) {
        bins.first += bins.across * bins.down;
        bins.across = (bins.across + (1 << BIN_SHIFT) - 1) >> BIN_SHIFT;
        bins.down = (bins.down + (1 << BIN_SHIFT) - 1) >> BIN_SHIFT;
    }
    return bins;
}

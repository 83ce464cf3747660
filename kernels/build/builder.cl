// BVH builder: primitives along a space-filling curve, a binary BVH, optimisation by reinsertion; collapsing, which
// decides which nodes stay, become leaves or are opened; the wide nodes, level by level; records of nodes and leaves.
#include "build/morton.cl"
#include "build/ploc.cl"
#include REINSERTION
#include "build/collapse.cl"
#include "build/open.cl"
#include WRITER

// The builder of trees: primitives along a space-filling curve, a binary tree of them, its subtrees at better places;
// which of its nodes stay, become leaves or are opened; the wide nodes, level by level; records of nodes and leaves.
#include "build/morton.cl"
#include "build/ploc.cl"
#include REINSERTION
#include "build/collapse.cl"
#include "build/open.cl"
#include WRITER

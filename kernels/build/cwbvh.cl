// Write the nodes and leaves of one level in the layout cwbvh (clrt/accel/cwbvh.py, kernels/traverse/cwbvh.cl).
#include "build/leaves.cl"

// The float exponent bits of the smallest power of two above extent / 255; 1, the smallest normal number's, at least.
static inline uint step_exponent(float extent) {
    uint exponent = as_uint(extent) >> 23;
    exponent = exponent > 8 ? exponent - 7 : 1;
    return extent < 255.0f * as_float(exponent << 23) ? exponent : exponent + 1;
}

// Write the children's boxes on one axis, in steps from the node's low corner; a box without a child is inverted.
static inline void write_axis(global Node *node, int axis, const float *lo, const float *hi, float low, float high) {
    uint exponent = step_exponent(high - low);
    float steps = as_float((254 - exponent) << 23);
    node->origin[axis] = low;
    node->exponent[axis] = exponent;
    for (int s = 0; s < CHILDREN; ++s) {
        node->lo[axis][s] = lo[s] <= hi[s] ? (uchar)floor((lo[s] - low) * steps) : 255;
        node->hi[axis][s] = lo[s] <= hi[s] ? (uchar)ceil((hi[s] - low) * steps) : 0;
    }
}

kernel void write_level(uint count, uint block, LEVEL_PARAMETERS) {
    FOR_NODES {
        global Node *node = nodes + first_node + i;
        OPEN_NODE
        float areas = 0.0f;
        float lo[3][CHILDREN], hi[3][CHILDREN];
        Box around = NO_BOX;
        bool spheres = false;
        uint inner = 0, leaf_place = 0;
        node->child = next.node;
        for (int s = 0; s < CHILDREN; ++s) {
            Content content = contents[s];
            Box box = NO_BOX;
            node->meta[s] = 0;
            if (content.count > 0) {
                box = node_box(&primitives, binary, content.node);
                around = box_union(around, box);
                areas += visited_area(box, content);
                fill_slot(&primitives, binary, content, &next, triangles, leaf_spheres);
                node->meta[s] = content.leaf ? ((1u << content.count) - 1) << 5 | leaf_place : 1u << 5 | (24u + s);
                leaf_place += content.leaf ? content.count : 0;
                inner |= content.leaf ? 0 : 1u << s;
                spheres |= content.leaf && content.sphere;
            }
            WRITE_COLUMN(lo, s, box.lo)
            WRITE_COLUMN(hi, s, box.hi)
        }
        node->imask = inner;
        node->primitive = spheres ? triangle_count + next.sphere - leaf_place : next.triangle - leaf_place;
        write_axis(node, 0, lo[0], hi[0], around.lo.x, around.hi.x);
        write_axis(node, 1, lo[1], hi[1], around.lo.y, around.hi.y);
        write_axis(node, 2, lo[2], hi[2], around.lo.z, around.hi.z);
        visited[first_node + i] = areas;
    }
}

/* Rays through Embree 4's C interface, on several threads; only time inside Embree's functions is counted.

   Embree is not linked: its functions come in as pointers. The records of rays are declared here as in Embree's manual
   (RTCRayHit, RTCRayHit8). A hit may end in inst_prim or not, by how Embree was built; nothing lies behind it.
   Rays are taken in blocks: records are filled, Embree is called for each, and the results are copied out. */

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>
#include <time.h>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

enum { CHUNK = 4096, BLOCK = 128, MAX_THREADS = 1024 };

/* RTCRayHit for N = 1, RTCRayHit8 for N = 8. */
#define RAY_HIT(N) \
    struct __attribute__((aligned(32))) { \
        float org_x[N], org_y[N], org_z[N], tnear[N], dir_x[N], dir_y[N], dir_z[N], time[N], tfar[N]; \
        uint32_t mask[N], id[N], flags[N]; \
        float ng_x[N], ng_y[N], ng_z[N], u[N], v[N]; \
        uint32_t prim[N], geom[N], inst[N], inst_prim[N]; \
    }

typedef RAY_HIT(1) Ray;
typedef RAY_HIT(8) Packet;

/* What the threads share. Either of `one` (rtcIntersect1, rtcOccluded1) and `eight` (their packets) is null. */
typedef struct {
    void (*one)(void *scene, void *ray, void *arguments);
    void (*eight)(const int *valid, void *scene, void *packet, void *arguments);
    void *scene, *arguments;
    const float *origins, *directions, *t_max;
    float *t;
    uint32_t *primitive;
    size_t count;
    atomic_size_t next;
    /* Nanoseconds of all threads together: from start to end, and of these inside Embree's functions. */
    atomic_llong life, inside, processor;
} Work;

typedef struct {
    long long wall, processor;
} Time;

static long long nanoseconds(clockid_t clock) {
    struct timespec time;
    clock_gettime(clock, &time);
    return time.tv_sec * 1000000000LL + time.tv_nsec;
}

static void start(Time *spent) {
    spent->processor -= nanoseconds(CLOCK_THREAD_CPUTIME_ID);
    spent->wall -= nanoseconds(CLOCK_MONOTONIC);
}

static void stop(Time *spent) {
    spent->wall += nanoseconds(CLOCK_MONOTONIC);
    spent->processor += nanoseconds(CLOCK_THREAD_CPUTIME_ID);
}

/* Ray i of all, as lane k of a record of N lanes. */
#define FILL(record, k, i) do { \
    const float *o = work->origins + 3 * (i), *d = work->directions + 3 * (i); \
    (record)->org_x[k] = o[0], (record)->org_y[k] = o[1], (record)->org_z[k] = o[2], (record)->tnear[k] = 0; \
    (record)->dir_x[k] = d[0], (record)->dir_y[k] = d[1], (record)->dir_z[k] = d[2], (record)->time[k] = 0; \
    (record)->tfar[k] = work->t_max[i], (record)->mask[k] = ~0u, (record)->id[k] = 0, (record)->flags[k] = 0; \
    (record)->prim[k] = (record)->geom[k] = (record)->inst[k] = ~0u; \
} while (0)

/* Rays first to first + n, n <= BLOCK. */
static void trace_ones(const Work *work, size_t first, size_t n, Time *spent) {
    Ray rays[BLOCK];
    for (size_t i = 0; i < n; ++i)
        FILL(&rays[i], 0, first + i);
    start(spent);
    for (size_t i = 0; i < n; ++i)
        work->one(work->scene, &rays[i], work->arguments);
    stop(spent);
    for (size_t i = 0; i < n; ++i) {
        work->t[first + i] = rays[i].tfar[0];
        work->primitive[first + i] = rays[i].prim[0];
    }
}

/* The same in packets; the last one repeats the last ray in the lanes that no ray is left for. */
static void trace_eights(const Work *work, size_t first, size_t n, Time *spent) {
    static const int valid[8] __attribute__((aligned(32))) = {-1, -1, -1, -1, -1, -1, -1, -1};
    Packet packets[BLOCK / 8];
    size_t count = (n + 7) / 8;
    for (size_t i = 0; i < 8 * count; ++i)
        FILL(&packets[i / 8], i % 8, first + (i < n ? i : n - 1));
    start(spent);
    for (size_t i = 0; i < count; ++i)
        work->eight(valid, work->scene, &packets[i], work->arguments);
    stop(spent);
    for (size_t i = 0; i < n; ++i) {
        work->t[first + i] = packets[i / 8].tfar[i % 8];
        work->primitive[first + i] = packets[i / 8].prim[i % 8];
    }
}

static void *worker(void *shared) {
    Work *work = shared;
    Time life = {0, 0}, inside = {0, 0};
    start(&life);
#ifdef __SSE__
    _mm_setcsr(_mm_getcsr() | 0x8040); /* denormals count as zero: Embree asks for it */
#endif
    for (size_t first; (first = atomic_fetch_add(&work->next, CHUNK)) < work->count;) {
        size_t end = work->count - first < CHUNK ? work->count : first + CHUNK;
        for (; first < end; first += BLOCK)
            (work->eight ? trace_eights : trace_ones)(work, first, end - first < BLOCK ? end - first : BLOCK, &inside);
    }
    stop(&life);
    atomic_fetch_add(&work->life, life.wall);
    atomic_fetch_add(&work->inside, inside.wall);
    atomic_fetch_add(&work->processor, inside.processor);
    return NULL;
}

/* Traces all rays of `work` on `threads` threads; returns 0, or the error that kept a thread from starting. */
int trace_all(Work *work, int threads) {
    pthread_t ids[MAX_THREADS];
    int started = 0, error = 0;
    work->next = 0;
    work->life = work->inside = work->processor = 0;
    for (; started < threads && started < MAX_THREADS && !error; started += !error)
        error = pthread_create(&ids[started], NULL, worker, work);
    while (started--)
        pthread_join(ids[started], NULL);
    return error;
}

/* For rtcSetDeviceMemoryMonitorFunction: adds up the bytes that Embree takes and gives back. */
bool count_bytes(void *total, ssize_t bytes, bool post) {
    (void)post;
    atomic_fetch_add((atomic_llong *)total, bytes);
    return true;
}

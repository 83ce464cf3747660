/* A driver of OpenCL that shows devices and can do nothing else, as told when it is compiled:
   PLATFORM, NAME, UNITS (compute units of the first; each further one has one less), COUNT (devices), TYPE (4: GPU),
   REVERSED (lists them from the last), UUIDS (with that extension), REFUSED (a query), ON_LOAD, ON_UNLOAD, ON_DEVICES (statements).
   It has no headers to include: the numbers are those of the OpenCL specification. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Object { void **functions; int number; } Object;

static void *functions[200];
static Object platform = {functions, 0}, devices[8];

static int nothing(void) { return 0; }

static int answer(const void *value, size_t length, size_t room, void *to, size_t *told) {
    if (told) *told = length;
    if (to && room < length) return -30;
    if (to) memcpy(to, value, length);
    return 0;
}

static int text(const char *value, size_t room, void *to, size_t *told) {
    return answer(value, strlen(value) + 1, room, to, told);
}

int clGetPlatformInfo(Object *of, unsigned query, size_t room, void *to, size_t *told) {
    (void)of;
    switch (query) {
    case 0x0900: return text("FULL_PROFILE", room, to, told);
    case 0x0901: return text("OpenCL 1.2 fake", room, to, told);
    case 0x0902: return text(PLATFORM, room, to, told);
    case 0x0904: return text("cl_khr_icd", room, to, told);
    case 0x0920: return text("FAKE", room, to, told);
    default: return text("fake", room, to, told);
    }
}

static int device_ids(Object *of, unsigned long kind, unsigned room, Object **to, unsigned *told) {
    (void)of;
    ON_DEVICES;
    if (told) *told = COUNT;
    if (COUNT == 0 || !(kind & TYPE || kind == 0xFFFFFFFF)) return -1;
    for (unsigned i = 0; to && i < room && i < COUNT; i++) to[i] = &devices[REVERSED ? COUNT - 1 - i : i];
    return 0;
}

static int device_info(Object *of, unsigned query, size_t room, void *to, size_t *told) {
    unsigned long type = TYPE, size = 1ul << 33;
    unsigned yes = 1, units = UNITS - of->number, mhz = 1000, place[4] = {0, 0x65 + of->number, 0, 0};
    if (query == REFUSED) return -30;
    unsigned char uuid[16] = {0xAB, of->number};
    switch (query) {
    case 0x1000: return answer(&type, sizeof type, room, to, told);
    case 0x1002: return answer(&units, sizeof units, room, to, told);
    case 0x100C: return answer(&mhz, sizeof mhz, room, to, told);
    case 0x1010: case 0x101F: return answer(&size, sizeof size, room, to, told);
    case 0x103A: return answer(&yes, sizeof yes, room, to, told);
    case 0x1026: case 0x1027: case 0x1028: return answer(&yes, sizeof yes, room, to, told);
    case 0x102B: return text(NAME, room, to, told);
    case 0x102F: return text("OpenCL 1.2 fake", room, to, told);
    case 0x1030: return text(UUIDS ? "cl_khr_device_uuid cl_khr_pci_bus_info" : "cl_khr_icd", room, to, told);
    case 0x1031: { Object *own = &platform; return answer(&own, sizeof own, room, to, told); }
    case 0x106A: return UUIDS ? answer(uuid, sizeof uuid, room, to, told) : -30;
    case 0x410F: return UUIDS ? answer(place, sizeof place, room, to, told) : -30;
    case 0x102C: case 0x102D: case 0x102E: return text("fake 1.0", room, to, told);
    default: return -30;
    }
}

int clIcdGetPlatformIDsKHR(unsigned room, Object **to, unsigned *told) {
    if (told) *told = 1;
    if (to && room) *to = &platform;
    return 0;
}

void *clGetExtensionFunctionAddress(const char *name) {
    return strcmp(name, "clIcdGetPlatformIDsKHR") ? NULL : (void *)clIcdGetPlatformIDsKHR;
}

__attribute__((constructor)) static void load(void) {
    for (int i = 0; i < 200; i++) functions[i] = (void *)nothing;
    functions[1] = (void *)clGetPlatformInfo;
    functions[2] = (void *)device_ids;
    functions[3] = (void *)device_info;
    for (int i = 0; i < 8; i++) devices[i] = (Object){functions, i};
    const char *log = getenv("FAKE_LOG");
    FILE *file = log ? fopen(log, "a") : NULL;
    if (file) { fprintf(file, "%s\n", PLATFORM); fclose(file); }
    ON_LOAD;
}

__attribute__((destructor)) static void unload(void) {
    ON_UNLOAD;
}

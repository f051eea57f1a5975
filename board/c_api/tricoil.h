/* tricoil for programs in C, or in any language that calls C: open a device, poll poses, close it.
 *
 * Positions are in metres, of the sensor in the source frame; quaternions turn vectors of the sensor frame into the source frame.
 * One tracker belongs to one thread at a time; several trackers may be open.
 */
#ifndef TRICOIL_H
#define TRICOIL_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tricoil_tracker tricoil_tracker; /* NOLINT(modernize-use-using): C */

/* NOLINTNEXTLINE(readability-identifier-naming): C */
typedef struct tricoil_pose {
    int64_t time_us;           /* device time of the newest measurement */
    uint32_t sequence;         /* counts poses */
    uint8_t sensor;            /* 0 to 3 */
    uint8_t valid;             /* 0: do not use this pose; flags say why */
    uint16_t flags;            /* bit numbers as core/tracking/pose_flags.hpp lists them */
    double position_m[3];      /* x, y, z */
    double quaternion_wxyz[4]; /* unit length */
    double position_std_m[3];  /* standard deviations of position along the axes of the source frame */
    double rotation_std_rad[3];
} tricoil_pose; /* NOLINT(modernize-use-using): C */

/* Opens a device (can:can0, usb:1209:0001, serial:/dev/ttyACM0; not sim:, which is the program's own), or, if the name ends in
 * .toml, what `tricoil run --config` takes. tracker: "direct", "previous", "previous-angles", "scaat"; NULL: as configured, or
 * "direct". The device may still be missing: it is waited for while polling, and found again after a cable pull. NULL on bad
 * input, or if coil lines are taken; then `error` (of error_size bytes, may be NULL) holds one line that says why. */
tricoil_tracker* tricoil_open(const char* device, const char* tracker, char* error, size_t error_size);

/* The next pose, waiting for it at most timeout_ms (below 0: as 0). 1: *pose is filled in; 0: none came; -1: an argument is NULL;
 * -2: out of memory. Call it often enough: it also keeps the device's watchdog fed, and some 250 poses are kept, the oldest being
 * dropped first. */
int tricoil_poll(tricoil_tracker* tracker, tricoil_pose* pose, int timeout_ms);

/* What the connection is doing or lacks, for a person to read; never empty. Lives until the next call with this tracker. */
const char* tricoil_status(tricoil_tracker* tracker);

/* Coils off, device released. NULL is allowed. */
void tricoil_close(tricoil_tracker* tracker);

#ifdef __cplusplus
}
#endif

#endif

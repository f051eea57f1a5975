/* C interface of tricoil: opens a device, polls poses, closes the device.
 *
 * Position: of the sensor in the source frame, m. Quaternion: converts sensor frame components of a vector to source frame
 * components. Only one thread at a time may use a tracker. Several trackers may be open.
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
    int64_t time_us;            /* device time of the newest measurement */
    uint32_t sequence;          /* pose counter */
    uint8_t sensor;             /* 0 to 3 */
    uint8_t valid;              /* 0: do not use this pose; flags give the reason */
    uint16_t flags;             /* bit numbers: see core/tracking/pose_flags.hpp */
    double position_m[3];       /* x, y, z */
    double quaternion_wxyz[4];  /* unit length */
    double position_std_m[3];   /* standard deviations along the axes of the source frame */
    double rotation_std_rad[3]; /* standard deviations of a small rotation about the axes of the source frame */
} tricoil_pose;                 /* NOLINT(modernize-use-using): C */

/* Opens a device.
 * device: can:can0, usb:1209:0001 or serial:/dev/ttyACM0 (sim: is not supported), or a configuration file of
 *   `tricoil run --config` whose name ends in .toml.
 * tracker: "direct", "previous", "previous-angles" or "scaat". NULL: the configured tracker, or "direct".
 * The device need not be connected yet: tricoil_poll() waits for it, and connects again after the cable was unplugged.
 * Returns NULL for invalid input, or if the coil lines are in use. `error` (error_size bytes; may be NULL) then holds the reason
 * in one line. */
tricoil_tracker* tricoil_open(const char* device, const char* tracker, char* error, size_t error_size);

/* Waits for the next pose, at most timeout_ms (negative: 0). Returns 1: *pose is set; 0: no pose came; -1: an argument is NULL;
 * -2: out of memory. Call it regularly: it also resets the device's watchdog. About 250 poses are buffered; the oldest are
 * dropped first. */
int tricoil_poll(tricoil_tracker* tracker, tricoil_pose* pose, int timeout_ms);

/* Connection status as text for the user; never empty. The pointer is valid until the next call with this tracker. */
const char* tricoil_status(tricoil_tracker* tracker);

/* Switches the coils off and releases the device. NULL is allowed. */
void tricoil_close(tricoil_tracker* tracker);

#ifdef __cplusplus
}
#endif

#endif

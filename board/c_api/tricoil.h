/* C interface of tricoil: opens a device, a simulation or a recording, and polls poses.
 *
 * Position: of the sensor in the source frame, m. Quaternion: converts sensor frame components of a vector to source frame
 * components. Poses come from tricoil_poll() alone; there are no callbacks. Threads: only one thread at a time may use a tracker,
 * but not always the same one; several trackers may be open, each in its own thread.
 */
#ifndef TRICOIL_H
#define TRICOIL_H

/* The shared library exports only these functions. */
#define TRICOIL_API __attribute__((visibility("default")))

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Flags of a pose. All except warnings make the pose invalid. */
/* NOLINTNEXTLINE(readability-identifier-naming,cert-dcl37-c): C */
enum tricoil_flag {
    TRICOIL_FLAG_SATURATED = 1 << 0,          /* a channel reached full scale or clipped: couplings are too small */
    TRICOIL_FLAG_LOW_SIGNAL = 1 << 1,         /* signal-to-noise ratio below the limit */
    TRICOIL_FLAG_NO_SENSOR = 1 << 2,          /* no dipole fits the couplings: open inputs, or a dead channel */
    TRICOIL_FLAG_DISTORTED = 1 << 3,          /* warning: couplings differ from those of a dipole, as near metal */
    TRICOIL_FLAG_WRONG_HANDEDNESS = 1 << 4,   /* a coil is reversed, or two are swapped */
    TRICOIL_FLAG_STALE = 1 << 5,              /* no usable measurement for some time; the pose is the last known one */
    TRICOIL_FLAG_NOT_CONVERGED = 1 << 6,      /* the solver did not converge */
    TRICOIL_FLAG_HEMISPHERE_UNKNOWN = 1 << 7, /* the sign of the position is a guess */
    TRICOIL_FLAG_NO_REFERENCE = 1 << 8,       /* no source current */
    TRICOIL_FLAG_UNCONFIRMED = 1 << 9,        /* the newest measurements contradict the prediction, or too few agree yet */
    TRICOIL_FLAG_INCONSISTENT = 1 << 10,      /* the last measurements differ more than their noise allows */
    TRICOIL_FLAG_COASTING = 1 << 11,          /* warning: no new measurement; the pose is predicted */
    TRICOIL_FLAG_UNCERTAIN = 1 << 12,         /* the standard deviation of the position is above its limit */
    TRICOIL_FLAG_COLUMNS_MISSING = 1 << 13,   /* warning: some of the last measurements were lost or refused */
    TRICOIL_FLAG_ROLL_UNDEFINED = 1 << 14     /* warning: the rotation about x of the sensor frame is arbitrary: one coil */
};

typedef struct tricoil_tracker tricoil_tracker; /* NOLINT(modernize-use-using): C */

/* NOLINTNEXTLINE(readability-identifier-naming): C */
typedef struct tricoil_pose {
    int64_t time_us;            /* device time of the newest measurement */
    uint32_t sequence;          /* pose counter */
    uint8_t sensor;             /* 0 to 3 */
    uint8_t valid;              /* 0: do not use this pose; flags give the reason */
    uint16_t flags;             /* TRICOIL_FLAG_... */
    double position_m[3];       /* x, y, z; NaN, with infinite deviations, if there is no sensor or no source current */
    double quaternion_wxyz[4];  /* unit length */
    double position_std_m[3];   /* standard deviations along the axes of the source frame */
    double rotation_std_rad[3]; /* standard deviations of a small rotation about the axes of the source frame */
    double distortion_m;        /* position error (3D, RMS) that metal near the coils suggests; part of position_std_m */
    double snr_db;              /* coupling relative to its noise */
    double covariance[6][6]; /* of position (m), then of a small rotation (rad), along and about the axes of the source frame */
    double couplings[3][3];  /* signal matrix X of this pose: sensor coil, source coil; zero if the device solved it */
} tricoil_pose;              /* NOLINT(modernize-use-using): C */

/* Opens a source of poses:
 * - can:can0[#NODE], usb:1209:0001[:SERIAL] or serial:/dev/ttyACM0: a device.
 *   ,hemisphere=1/0/0 is the direction to the half space of the sensor, ,confined means that the sensor never leaves it (wall,
 *   table), so that it is found again after any loss;
 * - columns:WHERE or couplings:WHERE: text of other hardware, of a file, standard input (-), tcp:PORT or udp:PORT;
 * - board.toml: the device of a configuration file of `tricoil run --config`;
 * - sim:hand or sim:hand,mux=tdm,seed=2: a simulation of a scenario of `tricoil run --list`. Keys: mux (tdm, fdm, dual-band),
 *   rate_hz, duration_s, seed, noise (yes, no), stations (1 to 4 sensors), realtime (yes, no; default no: as fast as it is
 *   polled);
 * - recording:FOLDER: a recording of `tricoil run --record`, tracked again.
 *
 * tracker: "direct", "previous", "scaat", or "dual-band" with columns of two bands (mux=dual-band);
 * "scaat,predict_s=0.02" gives poses 20 ms (at most 0.1 s) ahead of the newest measurement. NULL: that of the configuration or
 * recording, otherwise "direct".
 *
 * A device need not be connected yet: tricoil_poll() waits for it, and connects again after the cable was unplugged. After a long
 * pause poses are invalid (hemisphere unknown) unless the file says `confined = true` in [tracker]. A tracker that is opened
 * again starts with the hemisphere of the file.
 *
 * Returns NULL for invalid input, or if the coil lines are in use. `error` (error_size bytes; may be NULL) then holds the reason
 * in one line. */
TRICOIL_API tricoil_tracker* tricoil_open(const char* source, const char* tracker, char* error, size_t error_size);

/* Waits for the next pose, at most timeout_ms (negative: 0). Returns 1: *pose is set; 0: no pose came; -1: an argument is NULL;
 * -2: out of memory; -3: the simulation or recording has ended; -4: the source failed, tricoil_status() gives the reason. With a
 * device, call it regularly: it also resets the device's watchdog. 256 poses are buffered; the oldest are dropped first. A gap in
 * `sequence` of a sensor tells how many. */
TRICOIL_API int tricoil_poll(tricoil_tracker* tracker, tricoil_pose* pose, int timeout_ms);

/* Half space of a sensor (0 to 3): direction from the source to it, source frame, any length. Returns 0; -1: an argument is NULL,
 * zero or not finite, the sensor is not 0 to 3 or not simulated, or the source is a recording (it contains the hemisphere). */
TRICOIL_API int tricoil_set_hemisphere(tricoil_tracker* tracker, int sensor, const double towards[3]);

/* Tip of a tool, in the sensor frame, m: from now on poses give the position of the tip. Returns 0; -1: an argument is NULL or
 * not finite, or the sensor is not 0 to 3. */
TRICOIL_API int tricoil_set_tip(tricoil_tracker* tracker, int sensor, const double tip_m[3]);

/* From now on the attitude of the last polled pose of this sensor reads as the unit quaternion. Returns 0; -1: that pose is not
 * valid, there is none, or an argument is NULL or not a sensor. */
TRICOIL_API int tricoil_boresight(tricoil_tracker* tracker, int sensor);

/* Status as text for the user; never empty. The pointer is valid until the next call with this tracker. */
TRICOIL_API const char* tricoil_status(tricoil_tracker* tracker);

/* Switches the coils off and releases the device. NULL is allowed. */
TRICOIL_API void tricoil_close(tricoil_tracker* tracker);

#ifdef __cplusplus
}
#endif

#endif

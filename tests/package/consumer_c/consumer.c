/* Example in C: prints ten poses of a device, for instance serial:/dev/ttyACM0 */
#include <stdio.h>
#include <tricoil/tricoil.h>

int main(int argc, char** argv) {
    char error[256];
    tricoil_tracker* tracker = tricoil_open(argc > 1 ? argv[1] : NULL, "scaat", error, sizeof error);
    if (tracker == NULL) {
        fprintf(stderr, "%s\n", error);
        return 2;
    }
    int poses = 0;
    for (int waits = 0; poses < 10 && waits < 100; ++waits) {
        tricoil_pose pose;
        if (tricoil_poll(tracker, &pose, 100) == 1 && pose.valid) {
            printf("%.3f s: %.4f %.4f %.4f m\n", 1e-6 * (double)pose.time_us, pose.position_m[0], pose.position_m[1],
                   pose.position_m[2]);
            ++poses;
        }
    }
    fprintf(poses < 10 ? stderr : stdout, "%d poses: %s\n", poses, tricoil_status(tracker));
    tricoil_close(tracker);
    return poses == 10 ? 0 : 3;
}

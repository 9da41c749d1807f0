/*
 * A position loop in C around a model that knows nothing of C.
 *
 *   vpm compile examples/emps/model.toml --rate 1000 --out axis.json
 *   make c-library
 *   cc -O2 -I dist/c examples/c/position_loop.c dist/c/libvpm.a -lpthread -ldl -lm -o position_loop
 *   ./position_loop axis.json
 */
#include "vpm.h"

#include <stdio.h>

/* Where the axis shall go, m, and the gains of the loop, V/m and V s/m. */
static const double reference = 0.1;
static const double stiffness = 80.0;
static const double damping = 12.0;

int main(int count, char **arguments)
{
    char message[512] = "";
    double command, seen[16] = {0.0};
    VpmSimulation *axis;

    if (count != 2) {
        fprintf(stderr, "usage: %s COMPILED_MODEL\n", arguments[0]);
        return 2;
    }
    axis = vpm_open(arguments[1], message, sizeof message);
    if (axis == NULL) {
        fprintf(stderr, "%s\n", message);
        return 1;
    }
    if (vpm_input_count(axis) != 1 || vpm_output_count(axis) > sizeof seen / sizeof seen[0]) {
        fprintf(stderr, "this example controls one axis\n");
        vpm_close(axis);
        return 1;
    }
    printf("input %s, outputs %s, %s\n", vpm_input_name(axis, 0), vpm_output_name(axis, 0), vpm_output_name(axis, 1));
    for (int k = 0; k < 1000; ++k) {
        command = stiffness * (reference - seen[0]) - damping * seen[1];
        if (vpm_step(axis, &command, seen) != VPM_OK) {
            fprintf(stderr, "%s\n", vpm_message(axis));
            vpm_close(axis);
            return 1;
        }
    }
    printf("after %.3f s: %.5f m at %.5f m/s\n", vpm_time(axis), seen[0], seen[1]);
    vpm_close(axis);
    return 0;
}

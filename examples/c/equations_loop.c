/* A position loop at 1 kHz around the equations of an axis, with no library but the C library's own:
 *
 *     vpm compile examples/emps/model.toml --c axis --name axis
 *     cc -O2 -I axis examples/c/equations_loop.c axis/axis.c -lm -o equations_loop
 *     ./equations_loop
 */
#include "axis.h"

#include <stdio.h>

int main(void)
{
    double state[axis_NX] = {0.0}, command[axis_NU] = {0.0}, outputs[axis_NY], work[axis_NW];
    int sample;
    for (sample = 0; sample < 1000; ++sample) {
        axis_evaluate_outputs(state, command, axis_constants, work, outputs);
        command[0] = 80.0 * (0.01 - outputs[0]) - 12.0 * outputs[1];
        if (axis_step_rosenbrock(state, command, axis_constants, 1e-3, work, state) != 0) {
            fprintf(stderr, "sample %d: the step met a singular matrix\n", sample);
            return 1;
        }
    }
    printf("%s %.17g\n", axis_output_names[0], state[0]);
    return 0;
}

/* The functions for C with arguments that are wrong in each way that they promise to bear. Usage: interface MODEL... */
#include "vpm.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void need(int held, const char *what)
{
    if (!held) {
        fprintf(stderr, "not so: %s\n", what);
        exit(1);
    }
}

/* An array of exactly so many numbers, so that one more is seen. */
static double *filled(size_t count, double value)
{
    double *numbers = malloc(count * sizeof(double));
    size_t k;
    for (k = 0; k < count; ++k) {
        numbers[k] = value;
    }
    return numbers;
}

static void without_a_simulation(void)
{
    double number = 0.0;
    need(vpm_step(NULL, &number, &number) == VPM_INVALID, "a step of no simulation is invalid");
    need(vpm_reset(NULL, &number) == VPM_INVALID, "a reset of no simulation is invalid");
    need(vpm_set_parameters(NULL, &number) == VPM_INVALID, "parameters of no simulation are invalid");
    need(vpm_parameters(NULL, &number) == VPM_INVALID, "parameters of no simulation are not told");
    need(vpm_state(NULL, &number) == VPM_INVALID, "the state of no simulation is not told");
    need(vpm_outputs(NULL, &number) == VPM_INVALID, "outputs of no simulation are not told");
    need(isnan(vpm_time(NULL)) && isnan(vpm_time_step(NULL)), "no simulation has no time");
    need(vpm_input_count(NULL) + vpm_output_count(NULL) + vpm_state_count(NULL) + vpm_parameter_count(NULL) == 0, "nothing");
    need(vpm_input_name(NULL, 0) == NULL && vpm_state_name(NULL, 0) == NULL, "no simulation has no names");
    need(strlen(vpm_message(NULL)) > 0 && strlen(vpm_version()) > 0, "there is a sentence");
    vpm_close(NULL);
}

/* A message is cut where its room ends, and nothing is written beyond it. */
static void refused(const char *path)
{
    size_t size;
    for (size = 0; size < 40; ++size) {
        char *message = malloc(size ? size : 1);
        memset(message, 1, size ? size : 1);
        need(vpm_open_text("{", message, size) == NULL, "half a text is refused");
        need(size == 0 || memchr(message, 0, size) != NULL, "the message ends");
        need(vpm_open(path, message, size) == NULL, "a file that is not there is refused");
        free(message);
    }
    need(vpm_open(NULL, NULL, 0) == NULL && vpm_open_text(NULL, NULL, 99) == NULL, "no text is refused");
    need(vpm_open_text("\xff\xfe", NULL, 0) == NULL, "what is no UTF-8 is refused");
}

static void hostile(VpmSimulation *simulation)
{
    static const double numbers[] = {0.0, 1e-3, -1e300, 1e155, 5e-324, INFINITY, -INFINITY, NAN};
    size_t inputs = vpm_input_count(simulation), outputs = vpm_output_count(simulation), k;
    size_t states = vpm_state_count(simulation), parameters = vpm_parameter_count(simulation);
    double *seen = filled(outputs, 0.0), *kept = filled(parameters, 0.0), *state = filled(states, 0.0);
    need(vpm_parameters(simulation, kept) == VPM_OK, "parameters are told");
    need(vpm_parameters(simulation, NULL) == VPM_INVALID, "there has to be room for parameters");
    need(vpm_step(simulation, NULL, seen) == VPM_INVALID || inputs == 0, "there have to be inputs");
    need(vpm_set_parameters(simulation, NULL) == VPM_INVALID || parameters == 0, "there have to be parameters");
    for (k = 0; k < sizeof numbers / sizeof numbers[0]; ++k) {
        double *given = filled(inputs, numbers[k]), *begin = filled(states, numbers[k]), *other = filled(parameters, numbers[k]);
        int finite = isfinite(numbers[k]);
        size_t j;
        need(vpm_reset(simulation, NULL) == VPM_OK, "the start of the file is one");
        VpmStatus ended = vpm_step(simulation, given, seen);
        need(ended != VPM_FAULT && (finite || ended == VPM_INVALID || inputs == 0), "hostile inputs");
        for (j = 0; ended == VPM_OK && j < outputs; ++j) {
            need(isfinite(seen[j]), "outputs are numbers");
        }
        need(vpm_step(simulation, given, NULL) != VPM_FAULT, "outputs may be left out");
        ended = vpm_reset(simulation, begin);
        need(ended != VPM_FAULT && (finite || ended == VPM_INVALID || states == 0), "hostile states");
        need(vpm_step(simulation, given, seen) != VPM_FAULT, "a step from there");
        ended = vpm_set_parameters(simulation, other);
        need(ended != VPM_FAULT && (finite || ended == VPM_INVALID || parameters == 0), "hostile parameters");
        need(vpm_set_parameters(simulation, kept) == VPM_OK, "the own parameters are right");
        free(given);
        free(begin);
        free(other);
    }
    need(vpm_state(simulation, state) == VPM_OK && vpm_outputs(simulation, seen) == VPM_OK, "state and outputs are told");
    need(vpm_input_name(simulation, inputs) == NULL, "no name beyond the last");
    need(vpm_state_name(simulation, SIZE_MAX) == NULL && vpm_parameter_name(simulation, parameters) == NULL, "the same");
    for (k = 0; k < outputs; ++k) {
        need(strlen(vpm_output_name(simulation, k)) > 0, "outputs have names");
    }
    free(seen);
    free(kept);
    free(state);
}

int main(int count, char **paths)
{
    int k;
    without_a_simulation();
    refused("/there/is/no/such/file");
    for (k = 1; k < count; ++k) {
        char message[200] = "";
        VpmSimulation *simulation = vpm_open(paths[k], message, sizeof message);
        if (simulation == NULL) {
            fprintf(stderr, "%s: %s\n", paths[k], message);
            return 1;
        }
        hostile(simulation);
        vpm_close(simulation);
    }
    printf("%d models\n", count - 1);
    return 0;
}

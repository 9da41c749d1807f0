/* All functions of a machine's C source with numbers of all kinds. Compiled with -DNAME=axis -DHEADER='"axis.h"'. */
#include HEADER

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define JOIN_(name, part) name##_##part
#define JOIN(name, part) JOIN_(name, part)
#define OF(part) JOIN(NAME, part)

static unsigned long long dice = 0x9E3779B97F4A7C15ULL;

static double number(void)
{
    static const double hostile[] = {0.0, -0.0, 1e-300, -1e155, 1e308, 5e-324, INFINITY, -INFINITY, NAN, 1e19, -1e19};
    dice ^= dice << 13;
    dice ^= dice >> 7;
    dice ^= dice << 17;
    if (dice % 4 == 0) {
        return hostile[(dice >> 8) % (sizeof hostile / sizeof hostile[0])];
    }
    return ((double)(dice >> 11) / 9007199254740992.0 - 0.5) * pow(10.0, (double)((dice >> 3) % 7) - 3.0);
}

/* Arrays of exactly their lengths, so that one entry more is seen. */
static double *some(int count, const double *from)
{
    double *numbers = malloc((size_t)count * sizeof(double));
    int k;
    for (k = 0; k < count; ++k) {
        numbers[k] = from ? from[k] : number();
    }
    return numbers;
}

int main(int count, char **arguments)
{
    int round, rounds = count > 1 ? atoi(arguments[1]) : 100;
    for (round = 0; round < rounds; ++round) {
        double *p = some(OF(NP), round % 2 ? OF(parameters) : NULL), *c = some(OF(NC), OF(constants));
        double *x = some(OF(NX), NULL), *u = some(OF(NU), NULL), *w = some(OF(NW), NULL);
        double *dx = some(OF(NX), NULL), *y = some(OF(NY), NULL), *next = some(OF(NX), NULL);
        double *dx_x = some(OF(NNZ_RATES_X), NULL), *dx_u = some(OF(NNZ_RATES_U), NULL), *dx_p = some(OF(NNZ_RATES_P), NULL);
        double *y_x = some(OF(NNZ_OUTPUTS_X), NULL), *y_u = some(OF(NNZ_OUTPUTS_U), NULL);
        double *y_p = some(OF(NNZ_OUTPUTS_P), NULL), *full = some(OF(NX) * OF(NX), NULL), h = fabs(number());
        OF(prepare)(p, w, c);
        OF(evaluate_rates)(x, u, c, w, dx);
        OF(evaluate_outputs)(x, u, c, w, y);
        OF(evaluate_rates_jacobian)(x, u, c, w, dx, dx_x, dx_u, dx_p);
        OF(evaluate_outputs_jacobian)(x, u, c, w, y, y_x, y_u, y_p);
        OF(dense)(OF(rates_by_x), dx_x, full);
        OF(step_rk4)(x, u, c, h, w, next);
        (void)OF(step_rosenbrock)(x, u, c, h, w, x);
        free(p), free(c), free(x), free(u), free(w), free(dx), free(y), free(next), free(dx_x), free(dx_u), free(dx_p);
        free(y_x), free(y_u), free(y_p), free(full);
    }
    printf("%d rounds\n", rounds);
    return 0;
}

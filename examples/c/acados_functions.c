/* The functions that the implicit integrators of acados ask for, from those of a machine:
 *
 *     vpm compile examples/emps/model.toml --c axis --name axis
 *     cc -O2 -fPIC -shared -Dcasadi_int=int -I axis examples/c/acados_functions.c axis/axis.c -lm -o libaxis.so
 *
 * acados solves 0 = dx/dt - rates(x, u, p) with functions of (x, dx/dt, u, z, t, p); there is no z here, and time does nothing.
 */
#include "axis.h"

#include <stddef.h>

enum { X, XDOT, U, Z, T, P };

/* Rows, columns, and a one for "full"; or, of what is empty, where its columns begin. */
static const casadi_int states[3] = {axis_NX, 1, 1}, inputs[3] = {axis_NU, 1, 1}, parameters[3] = {axis_NP, 1, 1};
static const casadi_int square[3] = {axis_NX, axis_NX, 1}, time[3] = {1, 1, 1};
static const casadi_int no_z[4] = {0, 1, 0, 0}, by_no_z[3] = {axis_NX, 0, 0};

/* What acados asks of a function beside its values. */
#define TOLD(f, count, ...)                                                                             \
    casadi_int f##_n_in(void) { return 6; }                                                             \
    casadi_int f##_n_out(void) { return count; }                                                        \
    const casadi_int *f##_sparsity_in(casadi_int i)                                                     \
    {                                                                                                   \
        const casadi_int *const patterns[6] = {states, states, inputs, no_z, time, parameters};         \
        return patterns[i];                                                                             \
    }                                                                                                   \
    const casadi_int *f##_sparsity_out(casadi_int i)                                                    \
    {                                                                                                   \
        const casadi_int *const patterns[count] = {__VA_ARGS__};                                        \
        return patterns[i];                                                                             \
    }                                                                                                   \
    int f##_work(casadi_int *args, casadi_int *results, casadi_int *iw, casadi_int *w)                  \
    {                                                                                                   \
        *args = 6, *results = count, *iw = 0, *w = axis_NW_EXTERNAL;                                    \
        return 0;                                                                                       \
    }

TOLD(axis_impl_dae_fun, 1, states)
TOLD(axis_impl_dae_fun_jac_x_xdot_z, 4, states, axis_rates_by_x, square, by_no_z)
TOLD(axis_impl_dae_jac_x_xdot_u_z, 4, axis_rates_by_x, square, axis_rates_by_u, by_no_z)

static void turn(casadi_real *entries, int count)
{
    while (count-- > 0) entries[count] = -entries[count];
}

static void one(casadi_real *matrix)
{
    int k;
    for (k = 0; k < axis_NX * axis_NX; ++k) matrix[k] = k % (axis_NX + 1) == 0;
}

int axis_impl_dae_fun(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const casadi_real *given[3] = {arg[X], arg[U], arg[P]};
    int k;
    if (axis_rates(given, res, iw, w, mem) != 0) return 1;
    for (k = 0; k < axis_NX; ++k) res[0][k] = arg[XDOT][k] - res[0][k];
    return 0;
}

int axis_impl_dae_jac_x_xdot_u_z(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const casadi_real *given[4] = {arg[X], arg[U], arg[P], NULL};
    casadi_real *found[3] = {res[0], res[2], NULL};
    if (jac_axis_rates(given, found, iw, w, mem) != 0) return 1;
    turn(res[0], axis_NNZ_RATES_X);
    if (res[2] != NULL) turn(res[2], axis_NNZ_RATES_U);
    one(res[1]);
    return 0;
}

int axis_impl_dae_fun_jac_x_xdot_z(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    casadi_real *found[4] = {res[1], res[2], NULL, NULL};
    if (axis_impl_dae_fun(arg, res, iw, w, mem) != 0) return 1;
    return axis_impl_dae_jac_x_xdot_u_z(arg, found, iw, w, mem);
}

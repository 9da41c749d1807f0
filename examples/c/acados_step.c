/* What an implicit integrator of acados does with the functions of acados_functions.c, without acados: one step of the Gauss method of two
 * stages (order 4) by Newton's method with exact Jacobians, and the sensitivities of its end.
 *
 *     cc -O2 -Dcasadi_int=int -I axis examples/c/acados_step.c examples/c/acados_functions.c axis/axis.c -lm -o acados_step
 *     ./acados_step 0.01 0.1 0.5 0.005
 *
 * takes the state, the inputs and the length of the step; prints the next state, then its derivatives by state and inputs, column by
 * column. Source of the method: Hairer, Norsett & Wanner 1993, Solving Ordinary Differential Equations I, table II.7.3.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* As acados declares the functions of a model and keeps them. */
typedef struct {
    int (*run)(const double **, double **, int *, double *, int);
    int (*work)(int *, int *, int *, int *);
    const int *(*sparsity_in)(int);
    const int *(*sparsity_out)(int);
    int (*n_in)(void);
    int (*n_out)(void);
} External;
#define DECLARED(f)                                              \
    int f(const double **, double **, int *, double *, int);     \
    int f##_work(int *, int *, int *, int *);                    \
    const int *f##_sparsity_in(int);                             \
    const int *f##_sparsity_out(int);                            \
    int f##_n_in(void);                                          \
    int f##_n_out(void);                                         \
    static const External kept_##f = {f, f##_work, f##_sparsity_in, f##_sparsity_out, f##_n_in, f##_n_out};
DECLARED(axis_impl_dae_fun_jac_x_xdot_z)
DECLARED(axis_impl_dae_jac_x_xdot_u_z)

static const double A[2][2] = {{0.25, 0.25 - 0.28867513459481288}, {0.25 + 0.28867513459481288, 0.25}};

/* Full columns of a result that came as its entries. */
static void full(const int *pattern, const double *entries, double *matrix)
{
    const int rows = pattern[0], columns = pattern[1], *first = pattern + 2, *row = first + columns + 1;
    int j, k;
    for (k = 0; k < rows * columns; ++k) matrix[k] = first[0] == 1 ? entries[k] : 0.0;
    for (j = 0; first[0] != 1 && j < columns; ++j)
        for (k = first[j]; k < first[j + 1]; ++k) matrix[j * rows + row[k]] = entries[k];
}

/* Results of a function at a stage, each with all its entries. */
static int call(const External *f, const double **arg, double **results, double *w)
{
    double *sparse[4];
    int i, failed;
    for (i = 0; i < f->n_out(); ++i) {
        const int *pattern = f->sparsity_out(i);
        sparse[i] = calloc((size_t)(pattern[0] * pattern[1]) + 1, sizeof(double));
        if (sparse[i] == NULL) return 1;
    }
    failed = f->run(arg, sparse, NULL, w, 0);
    for (i = 0; i < f->n_out(); ++i) {
        full(f->sparsity_out(i), sparse[i], results[i]);
        free(sparse[i]);
    }
    return failed;
}

/* Solves for several right-hand sides, all column by column, by elimination with the largest pivot. */
static int solve(int n, double *matrix, int sides, double *right)
{
    int i, j, k;
    for (k = 0; k < n; ++k) {
        int best = k;
        for (i = k + 1; i < n; ++i)
            if (fabs(matrix[k * n + i]) > fabs(matrix[k * n + best])) best = i;
        if (!(fabs(matrix[k * n + best]) > 0.0)) return 1;
        for (j = 0; j < n + sides; ++j) {
            double *column = j < n ? matrix + j * n : right + (j - n) * n, moved = column[k];
            column[k] = column[best];
            column[best] = moved;
        }
        for (i = k + 1; i < n; ++i) {
            const double factor = matrix[k * n + i] / matrix[k * n + k];
            for (j = k + 1; j < n; ++j) matrix[j * n + i] -= factor * matrix[j * n + k];
            for (j = 0; j < sides; ++j) right[j * n + i] -= factor * right[j * n + k];
        }
    }
    for (j = 0; j < sides; ++j)
        for (i = n - 1; i >= 0; --i) {
            for (k = i + 1; k < n; ++k) right[j * n + i] -= matrix[k * n + i] * right[j * n + k];
            right[j * n + i] /= matrix[i * n + i];
        }
    return 0;
}

int main(int count, char **words)
{
    const External *rates = &kept_axis_impl_dae_fun_jac_x_xdot_z, *slopes = &kept_axis_impl_dae_jac_x_xdot_u_z;
    const int nx = rates->sparsity_in(0)[0], nu = rates->sparsity_in(2)[0], n = 2 * nx, sides = nx + nu;
    int args, results, iw, size, other, i, j, k, s, iteration;
    double *all, *x, *u, *stage, *slope, *by_x, *by_xdot, *by_u, *residual, *matrix, *right, *w, h, zero = 0.0;
    if (count != 2 + nx + nu) {
        fprintf(stderr, "give %d states, %d inputs and the length of the step\n", nx, nu);
        return 1;
    }
    if (rates->work(&args, &results, &iw, &size) != 0 || slopes->work(&args, &results, &iw, &other) != 0) return 1;
    size = size > other ? size : other;
    all = calloc((size_t)(nx + nu + nx + n + 2 * nx * nx + nx * nu + n + n * n + n * sides + size + 1), sizeof(double));
    if (all == NULL) return 1;
    x = all, u = x + nx, stage = u + nu, slope = stage + nx, by_x = slope + n, by_xdot = by_x + nx * nx, by_u = by_xdot + nx * nx;
    residual = by_u + nx * nu, matrix = residual + n, right = matrix + n * n, w = right + n * sides;
    for (k = 0; k < nx + nu; ++k) x[k] = atof(words[1 + k]);
    h = atof(words[1 + nx + nu]);
    for (iteration = 0; iteration < 11; ++iteration) {
        /* The last time the Jacobians are taken at the solution, for the sensitivities. */
        const int last = iteration == 10;
        for (i = 0; i < 2; ++i) {
            const double *arg[6] = {stage, slope + i * nx, u, NULL, &zero, NULL};
            double nothing[1];
            double *of_rates[4] = {residual + i * nx, by_x, by_xdot, nothing}, *of_slopes[4] = {by_x, by_xdot, by_u, nothing};
            for (k = 0; k < nx; ++k) stage[k] = x[k] + h * (A[i][0] * slope[k] + A[i][1] * slope[nx + k]);
            if (call(last ? slopes : rates, arg, last ? of_slopes : of_rates, w) != 0) return 1;
            for (s = 0; s < 2; ++s)
                for (j = 0; j < nx; ++j)
                    for (k = 0; k < nx; ++k)
                        matrix[(s * nx + j) * n + i * nx + k] = h * A[i][s] * by_x[j * nx + k] + (i == s ? by_xdot[j * nx + k] : 0.0);
            for (j = 0; last && j < sides; ++j)
                for (k = 0; k < nx; ++k) right[j * n + i * nx + k] = j < nx ? -by_x[j * nx + k] : -by_u[(j - nx) * nx + k];
        }
        if (solve(n, matrix, last ? sides : 1, last ? right : residual) != 0) return 1;
        for (k = 0; !last && k < n; ++k) slope[k] -= residual[k];
    }
    for (k = 0; k < nx; ++k) printf("%.17g\n", x[k] + 0.5 * h * (slope[k] + slope[nx + k]));
    for (j = 0; j < sides; ++j)
        for (k = 0; k < nx; ++k) printf("%.17g\n", (j == k) + 0.5 * h * (right[j * n + k] + right[j * n + nx + k]));
    free(all);
    return 0;
}

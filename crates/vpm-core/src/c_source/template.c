void NAME_prepare(const double *p, double *w, double *c)
{
    int k;
    for (k = 0; k < NAME_NP; ++k) c[k] = p[k];
    NAME_run_prepare(p, w, c + NAME_NP);
}

int NAME_evaluate_rates(const double *x, const double *u, const double *c, double *w, double *dx)
{
    NAME_run_rates(x, u, AT_ANGLES c, w, dx);
    return STATUS(x);
}

int NAME_evaluate_outputs(const double *x, const double *u, const double *c, double *w, double *y)
{
    NAME_run_outputs(x, u, AT_ANGLES c, w, y);
    return STATUS(x);
}

int NAME_evaluate_rates_jacobian(const double *x, const double *u, const double *c, double *w, double *dx, double *dx_x, double *dx_u,
                                 double *dx_p)
{
    NAME_run_rates_jacobian(x, u, AT_ANGLES c, w, dx, dx_x, dx_u, dx_p);
    return STATUS(x);
}

int NAME_evaluate_outputs_jacobian(const double *x, const double *u, const double *c, double *w, double *y, double *y_x, double *y_u,
                                   double *y_p)
{
    NAME_run_outputs_jacobian(x, u, AT_ANGLES c, w, y, y_x, y_u, y_p);
    return STATUS(x);
}

void NAME_dense(const casadi_int *pattern, const double *entries, double *matrix)
{
    const casadi_int rows = pattern[0], columns = pattern[1], *first = pattern + 2, *row = first + columns + 1;
    casadi_int j, k;
    for (k = 0; k < rows * columns; ++k) matrix[k] = 0.0;
    for (j = 0; j < columns; ++j)
        for (k = first[j]; k < first[j + 1]; ++k) matrix[row[k] * columns + j] = entries[k];
}

/* Hairer, Norsett & Wanner 1993, Solving Ordinary Differential Equations I, table II.1.2. */
int NAME_step_rk4(const double *x, const double *u, const double *c, double h, double *w, double *next)
{
    static const double weight[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}, distance[4] = {0.5, 0.5, 1.0, 0.0};
    double *rate = w + NAME_NW_RUN, *stage = rate + NAME_NX, *sum = stage + NAME_NX;
    int i, k;
    BEGIN(sum + NAME_NX)
    for (k = 0; k < NAME_NX; ++k) stage[k] = sum[k] = begin[k];
    for (i = 0; i < 4; ++i) {
        NAME_run_rates(stage, u, IN_STEP c, w, rate);
        for (k = 0; k < NAME_NX; ++k) {
            sum[k] += h * weight[i] * rate[k];
            stage[k] = begin[k] + h * distance[i] * rate[k];
        }
    }
    END(sum)
}

/* Gaussian elimination with the largest pivot of each column, in place; 1 if a column has none. */
static int NAME_factorise(double *matrix, int *pivot)
{
    int i, j, k, best;
    for (k = 0; k < NAME_NX; ++k) {
        best = k;
        for (i = k + 1; i < NAME_NX; ++i)
            if (fabs(matrix[i * NAME_NX + k]) > fabs(matrix[best * NAME_NX + k])) best = i;
        if (!(fabs(matrix[best * NAME_NX + k]) > 0.0)) return 1;
        pivot[k] = best;
        for (j = 0; j < NAME_NX; ++j) {
            const double moved = matrix[k * NAME_NX + j];
            matrix[k * NAME_NX + j] = matrix[best * NAME_NX + j];
            matrix[best * NAME_NX + j] = moved;
        }
        for (i = k + 1; i < NAME_NX; ++i) {
            const double factor = matrix[i * NAME_NX + k] /= matrix[k * NAME_NX + k];
            if (factor == 0.0) continue;
            for (j = k + 1; j < NAME_NX; ++j) matrix[i * NAME_NX + j] -= factor * matrix[k * NAME_NX + j];
        }
    }
    return 0;
}

static void NAME_solve(const double *matrix, const int *pivot, double *b)
{
    int i, j;
    for (i = 0; i < NAME_NX; ++i) {
        const double moved = b[i];
        b[i] = b[pivot[i]];
        b[pivot[i]] = moved;
    }
    for (i = 0; i < NAME_NX; ++i)
        for (j = 0; j < i; ++j) b[i] -= matrix[i * NAME_NX + j] * b[j];
    for (i = NAME_NX - 1; i >= 0; --i) {
        for (j = i + 1; j < NAME_NX; ++j) b[i] -= matrix[i * NAME_NX + j] * b[j];
        b[i] /= matrix[i * NAME_NX + i];
    }
}

/* Steinebach 2020, Improvement of Rosenbrock-Wanner method RODASP; Hairer & Wanner 1996, equation IV.7.25. */
int NAME_step_rosenbrock(const double *x, const double *u, const double *c, double h, double *w, double *next)
{
    static const double gamma = GAMMA;
    static const double distance[6][6] = DISTANCE;
    static const double coupling[6][6] = COUPLING;
    double *stage = w + NAME_NW_RUN, *matrix = stage + NAME_NX, *increments = matrix + NAME_NX * NAME_NX, *dx_x = increments + 6 * NAME_NX;
    double *dx_u = dx_x + NAME_NNZ_RATES_X, *dx_p = dx_u + NAME_NNZ_RATES_U;
    int pivot[NAME_NX + 1], i, j, k;
    BEGIN(dx_p + NAME_NNZ_RATES_P)
    NAME_run_rates_jacobian(begin, u, IN_STEP c, w, increments, dx_x, dx_u, dx_p);
    NAME_dense(NAME_rates_by_x, dx_x, matrix);
    for (k = 0; k < NAME_NX * NAME_NX; ++k) matrix[k] *= -gamma * h;
    for (k = 0; k < NAME_NX; ++k) matrix[k * NAME_NX + k] += 1.0;
    if (NAME_factorise(matrix, pivot) != 0) return NAME_SINGULAR_MATRIX;
    for (k = 0; k < NAME_NX; ++k) stage[k] = begin[k];
    for (i = 0; i < 6; ++i) {
        double *increment = increments + i * NAME_NX;
        if (i > 0) {
            for (k = 0; k < NAME_NX; ++k) stage[k] = begin[k];
            for (j = 0; j < i; ++j)
                for (k = 0; k < NAME_NX; ++k) stage[k] += distance[i][j] * increments[j * NAME_NX + k];
            NAME_run_rates(stage, u, IN_STEP c, w, increment);
        }
        for (k = 0; k < NAME_NX; ++k) increment[k] *= h;
        for (j = 0; j < i; ++j)
            for (k = 0; k < NAME_NX; ++k) increment[k] += coupling[i][j] * increments[j * NAME_NX + k];
        for (k = 0; k < NAME_NX; ++k) increment[k] *= gamma;
        NAME_solve(matrix, pivot, increment);
    }
    /* The last stage stands where the companion of third order ends. */
    for (k = 0; k < NAME_NX; ++k) stage[k] += increments[5 * NAME_NX + k];
    END(stage)
}

/* What CasADi and acados leave out is zero. */
static const double NAME_nothing[NAME_LONGEST] = {0.0};

static const double *NAME_given(const double *given)
{
    return given != NULL ? given : NAME_nothing;
}

/* Constants at the parameters given, prepared at the beginning of the working memory. */
static const double *NAME_prepared(const double *p, double **w)
{
    double *c = *w;
    if (NAME_NP == 0) return NAME_constants;
    *w += NAME_NC;
    NAME_prepare(NAME_given(p), *w, c);
    return c;
}

/* Where a result goes: to the caller, or if he does not ask for it to the working memory. */
static double *NAME_result(double *result, int length, double **scratch)
{
    double *own = *scratch;
    if (result != NULL) return result;
    *scratch += length;
    return own;
}

/* result += matrix * columns. */
static void NAME_add_product(const casadi_int *pattern, const double *entries, const double *columns, casadi_int count, double *result)
{
    const casadi_int rows = pattern[0], inner = pattern[1], *first = pattern + 2, *row = first + inner + 1;
    casadi_int j, k, n;
    for (n = 0; columns != NULL && n < count; ++n)
        for (j = 0; j < inner; ++j)
            for (k = first[j]; k < first[j + 1]; ++k) result[n * rows + row[k]] += entries[k] * columns[n * inner + j];
}

/* result = row * matrix. */
static void NAME_adjoint(const casadi_int *pattern, const double *entries, const double *left, double *result)
{
    const casadi_int columns = pattern[1], *first = pattern + 2, *row = first + columns + 1;
    casadi_int j, k;
    for (j = 0; j < columns; ++j) {
        result[j] = 0.0;
        for (k = first[j]; k < first[j + 1]; ++k) result[j] += entries[k] * left[row[k]];
    }
}

int NAME_rates(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(2), &w);
    (void)iw; (void)mem;
    if (res[0] != NULL) NAME_run_rates(NAME_given(arg[0]), NAME_given(arg[1]), AT_ANGLES c, w, res[0]);
    return STATUS(NAME_given(arg[0]));
}

int NAME_outputs(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(2), &w);
    (void)iw; (void)mem;
    if (res[0] != NULL) NAME_run_outputs(NAME_given(arg[0]), NAME_given(arg[1]), AT_ANGLES c, w, res[0]);
    return STATUS(NAME_given(arg[0]));
}

int jac_NAME_rates(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(2), &w);
    double *scratch = w + NAME_NW_RUN, *dx = NAME_result(NULL, NAME_NX, &scratch);
    double *dx_x = NAME_result(res[0], NAME_NNZ_RATES_X, &scratch), *dx_u = NAME_result(res[1], NAME_NNZ_RATES_U, &scratch);
    double *dx_p = NAME_result(RESULT(2), NAME_NNZ_RATES_P, &scratch);
    (void)iw; (void)mem;
    NAME_run_rates_jacobian(NAME_given(arg[0]), NAME_given(arg[1]), AT_ANGLES c, w, dx, dx_x, dx_u, dx_p);
    return STATUS(NAME_given(arg[0]));
}

int jac_NAME_outputs(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(2), &w);
    double *scratch = w + NAME_NW_RUN, *y = NAME_result(NULL, NAME_NY, &scratch);
    double *y_x = NAME_result(res[0], NAME_NNZ_OUTPUTS_X, &scratch), *y_u = NAME_result(res[1], NAME_NNZ_OUTPUTS_U, &scratch);
    double *y_p = NAME_result(RESULT(2), NAME_NNZ_OUTPUTS_P, &scratch);
    (void)iw; (void)mem;
    NAME_run_outputs_jacobian(NAME_given(arg[0]), NAME_given(arg[1]), AT_ANGLES c, w, y, y_x, y_u, y_p);
    return STATUS(NAME_given(arg[0]));
}

/* acados' explicit forward sensitivities: (x, Sx, Su, u, p) -> (f, A Sx, A Su + B). */
int NAME_expl_vde_forw(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(4), &w);
    double *scratch = w + NAME_NW_RUN, *dx = NAME_result(res[0], NAME_NX, &scratch);
    double *dx_x = NAME_result(NULL, NAME_NNZ_RATES_X, &scratch), *dx_u = NAME_result(NULL, NAME_NNZ_RATES_U, &scratch);
    double *dx_p = NAME_result(NULL, NAME_NNZ_RATES_P, &scratch);
    casadi_int j, k;
    (void)iw; (void)mem;
    NAME_run_rates_jacobian(NAME_given(arg[0]), NAME_given(arg[3]), AT_ANGLES c, w, dx, dx_x, dx_u, dx_p);
    if (res[1] != NULL) {
        for (k = 0; k < NAME_NX * NAME_NX; ++k) res[1][k] = 0.0;
        NAME_add_product(NAME_rates_by_x, dx_x, arg[1], NAME_NX, res[1]);
    }
    if (res[2] != NULL) {
        const casadi_int *first = NAME_rates_by_u + 2, *row = first + NAME_NU + 1;
        for (k = 0; k < NAME_NX * NAME_NU; ++k) res[2][k] = 0.0;
        for (j = 0; j < NAME_NU; ++j)
            for (k = first[j]; k < first[j + 1]; ++k) res[2][j * NAME_NX + row[k]] = dx_u[k];
        NAME_add_product(NAME_rates_by_x, dx_x, arg[2], NAME_NU, res[2]);
    }
    return STATUS(NAME_given(arg[0]));
}

/* acados' explicit adjoint sensitivities: (x, lambda, u, p) -> [A' lambda; B' lambda]. */
int NAME_expl_vde_adj(const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem)
{
    const double *c = NAME_prepared(PARAMETERS(3), &w);
    double *scratch = w + NAME_NW_RUN, *dx = NAME_result(NULL, NAME_NX, &scratch);
    double *dx_x = NAME_result(NULL, NAME_NNZ_RATES_X, &scratch), *dx_u = NAME_result(NULL, NAME_NNZ_RATES_U, &scratch);
    double *dx_p = NAME_result(NULL, NAME_NNZ_RATES_P, &scratch);
    (void)iw; (void)mem;
    NAME_run_rates_jacobian(NAME_given(arg[0]), NAME_given(arg[2]), AT_ANGLES c, w, dx, dx_x, dx_u, dx_p);
    if (res[0] != NULL) {
        NAME_adjoint(NAME_rates_by_x, dx_x, NAME_given(arg[1]), res[0]);
        NAME_adjoint(NAME_rates_by_u, dx_u, NAME_given(arg[1]), res[0] + NAME_NX);
    }
    return STATUS(NAME_given(arg[0]));
}

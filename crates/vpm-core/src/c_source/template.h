#ifndef NAME_H
#define NAME_H

/* CasADi's types; acados takes `int`: compile with -Dcasadi_int=int. */
#ifndef casadi_real
#define casadi_real double
#endif
#ifndef casadi_int
#define casadi_int long long int
#endif
#ifndef NAME_EXPORT
#if defined(_WIN32)
#define NAME_EXPORT __declspec(dllexport)
#else
#define NAME_EXPORT
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Lengths: states x, inputs u, outputs y, free parameters p, prepared constants c, working memory w, entries of derivatives. */
enum {
SIZES
};

extern NAME_EXPORT const char *const NAME_state_names[];
extern NAME_EXPORT const char *const NAME_input_names[];
extern NAME_EXPORT const char *const NAME_output_names[];
extern NAME_EXPORT const char *const NAME_parameter_names[];

/* The free parameters as the model has them, and the constants prepared from these. */
extern NAME_EXPORT const double NAME_parameters[];
extern NAME_EXPORT const double NAME_constants[];

/* Where the entries of the derivatives stand, as CasADi tells it: rows, columns, where each column begins (one more than columns),
   the row of each entry. */
extern NAME_EXPORT const casadi_int NAME_rates_by_x[];
extern NAME_EXPORT const casadi_int NAME_rates_by_u[];
extern NAME_EXPORT const casadi_int NAME_rates_by_p[];
extern NAME_EXPORT const casadi_int NAME_outputs_by_x[];
extern NAME_EXPORT const casadi_int NAME_outputs_by_u[];
extern NAME_EXPORT const casadi_int NAME_outputs_by_p[];

/* What functions return. NAME_ANGLES: the middle angle of a ball joint is so near to 90 degrees that its angles are no coordinates. */
enum { NAME_OK = 0, NAME_SINGULAR_MATRIX = 1, NAME_ANGLES = 2 };

/* Works out, from the free parameters, all that no state changes. */
NAME_EXPORT void NAME_prepare(const double *p, double *w, double *c);

/* dx/dt, and the outputs as sensors show them. No array may overlap another.

   States have the three angles of a ball joint and their rates. Where the cosine of its middle angle is below LEAST_COSINE these functions
   return NAME_ANGLES: rates, accelerations and what follows from them are then no numbers. Beside it they are right, but change so fast
   that steps of a solver in these angles may be far off; the steps below are not. */
NAME_EXPORT int NAME_evaluate_rates(const double *x, const double *u, const double *c, double *w, double *dx);
NAME_EXPORT int NAME_evaluate_outputs(const double *x, const double *u, const double *c, double *w, double *y);

/* The same with their exact derivatives by x, u and p: the entries that are not zero, column by column. */
NAME_EXPORT int NAME_evaluate_rates_jacobian(const double *x, const double *u, const double *c, double *w, double *dx, double *dx_x,
                                             double *dx_u, double *dx_p);
NAME_EXPORT int NAME_evaluate_outputs_jacobian(const double *x, const double *u, const double *c, double *w, double *y, double *y_x,
                                               double *y_u, double *y_p);

/* All entries of a matrix, row by row. */
NAME_EXPORT void NAME_dense(const casadi_int *pattern, const double *entries, double *matrix);

/* The state h seconds on, with u held: the classical Runge-Kutta method, and for stiff machines the linearly implicit Rodas4P2, which
   may meet a singular matrix (NAME_SINGULAR_MATRIX). `next` may be `x`; it is written where the step returns NAME_OK.

   Ball joints turn within a step by unit quaternions and are right in all orientations, with eight digits or more where the cosine of
   the middle angle is below SHOWN_COSINE. NAME_ANGLES: something needs the angles of such a joint (an effect, a drive), and it comes too near
   to 90 degrees for this step, or the step turns a joint by more than 60 degrees. */
NAME_EXPORT int NAME_step_rk4(const double *x, const double *u, const double *c, double h, double *w, double *next);
NAME_EXPORT int NAME_step_rosenbrock(const double *x, const double *u, const double *c, double h, double *w, double *next);

/* Functions of CasADi and acados; they return what the functions above return. */
EXTERNALS
#ifdef __cplusplus
}
#endif

#endif

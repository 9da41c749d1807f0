/* The published servo-cylinder under a chirp from 2 to 50 Hz, with the explicit Runge-Kutta pair of Dormand and Prince
   (Hairer, Norsett and Wanner 1993, "Solving Ordinary Differential Equations I", table II.5.2), written for this one machine.
   State: place (m), spool (A), velocity (m/s), spool rate (A/s), pressures (Pa). With LONG defined, in long double. */
#include <math.h>

#ifdef LONG
typedef long double real;
#define POWER powl
#define ROOT sqrtl
#define SINE sinl
#else
typedef double real;
#define POWER pow
#define ROOT sqrt
#define SINE sin
#endif
enum { N = 6, STAGES = 7 };

static const real pi = 3.14159265358979323846264338327950288L;

static real smaller(real a, real b) { return a < b ? a : b; }
static real larger(real a, real b) { return a > b ? a : b; }

static real root(real drop) {
    const real transition = 1e4;
    const real size = drop < 0 ? -drop : drop;
    if (size < transition) {
        const real s = drop / transition;
        return ROOT(transition) * s * (3 - (s < 0 ? -s : s)) / 2;
    }
    return drop < 0 ? -ROOT(size) : ROOT(size);
}

void rates(real t, const real *x, real *dx) {
    const real bore = 0.016L, rod = 0.010L, stroke = 0.080L, line = 2.9e-6L, leak = 1.7e-13L;
    const real beta = 1.2e9L, vapour = 1e3L, gain = 7.5L / 60e3L / (0.01L * ROOT(35e5L));
    const real w = 2 * pi * 250, damping = 0.7L, limit = 0.01L;
    const real mass = 3, viscous = 700, spring = 589.927L, supply = 16e6L, tank = 1e5L;
    const real full = pi / 4 * bore * bore, ring = full - pi / 4 * rod * rod;
    const real phase = (2 * pi * 2 + pi * 48 * t) * t;
    const real current = (real)0.5e-3L * SINE(phase);
    const real a = larger(x[4], vapour), b = larger(x[5], vapour);
    const real u = larger(-limit, smaller(limit, x[1]));
    const real into_a = u > 0 ? gain * u * root(supply - a) : gain * u * root(a - tank);
    const real out_of_b = u > 0 ? gain * u * root(b - tank) : gain * u * root(supply - b);
    const real past = leak * (a - b);
    dx[0] = x[2];
    dx[1] = x[3];
    dx[2] = (full * a - ring * b - viscous * x[2] - spring * x[0]) / mass;
    dx[3] = w * w * (larger(-limit, smaller(limit, current)) - x[1]) - 2 * damping * w * x[3];
    dx[4] = beta / (line + full * (stroke / 2 + x[0])) * (into_a - full * x[2] - past);
    dx[5] = beta / (line + ring * (stroke / 2 - x[0])) * (ring * x[2] - out_of_b + past);
}

/* One second, with `rows` rows of place and pressures; the number of evaluations, or -1. */
long run(real tolerance, int rows, double *shown) {
    static const real c[STAGES] = {0, 1 / 5.0L, 3 / 10.0L, 4 / 5.0L, 8 / 9.0L, 1, 1};
    static const real a[STAGES][STAGES - 1] = {
        {0},
        {1 / 5.0L},
        {3 / 40.0L, 9 / 40.0L},
        {44 / 45.0L, -56 / 15.0L, 32 / 9.0L},
        {19372 / 6561.0L, -25360 / 2187.0L, 64448 / 6561.0L, -212 / 729.0L},
        {9017 / 3168.0L, -355 / 33.0L, 46732 / 5247.0L, 49 / 176.0L, -5103 / 18656.0L},
        {35 / 384.0L, 0, 500 / 1113.0L, 125 / 192.0L, -2187 / 6784.0L, 11 / 84.0L}};
    static const real e[STAGES] = {71 / 57600.0L, 0, -71 / 16695.0L, 71 / 1920.0L, -17253 / 339200.0L, 22 / 525.0L, -1 / 40.0L};
    static const real scale[N] = {1e-2L, 1e-2L, 1, 16, 1e5L, 1e5L};
    const real ratio = (0.016L * 0.016L - 0.010L * 0.010L) / (0.016L * 0.016L), b = (16e6L + 1e5L) / (1 + ratio);
    real x[N] = {0, 0, 0, 0, ratio * b, b}, k[STAGES][N], y[N], t = 0, h = 1e-5L;
    long evaluations = 1;
    rates(t, x, k[0]);
    for (int row = 1; row <= rows; ++row) {
        const real end = (real)row / rows;
        while (t < end) {
            const int last = t + h >= end;
            const real taken = last ? end - t : h;
            real worst = 0;
            for (int i = 1; i < STAGES; ++i) {
                for (int n = 0; n < N; ++n) {
                    real sum = 0;
                    for (int j = 0; j < i; ++j) sum += a[i][j] * k[j][n];
                    y[n] = x[n] + taken * sum;
                }
                rates(t + c[i] * taken, y, k[i]);
            }
            evaluations += STAGES - 1;
            for (int n = 0; n < N; ++n) {
                real sum = 0;
                for (int j = 0; j < STAGES; ++j) sum += e[j] * k[j][n];
                const real size = larger(x[n] < 0 ? -x[n] : x[n], y[n] < 0 ? -y[n] : y[n]);
                const real off = taken * sum / (tolerance * (scale[n] + size));
                worst = larger(worst, off < 0 ? -off : off);
            }
            if (!(worst < 1e30L) || evaluations > 100000000) return -1;
            const real factor = larger(0.2L, smaller(5, 0.9L * POWER(worst + (real)1e-30L, (real)-0.2L)));
            if (worst <= 1) {
                t = last ? end : t + taken;
                for (int n = 0; n < N; ++n) x[n] = y[n], k[0][n] = k[STAGES - 1][n];
                h = last ? larger(h, taken * factor) : taken * factor;
            } else {
                h = taken * smaller(1, factor);
            }
        }
        shown[3 * row - 3] = (double)x[0];
        shown[3 * row - 2] = (double)x[4];
        shown[3 * row - 1] = (double)x[5];
    }
    return evaluations;
}

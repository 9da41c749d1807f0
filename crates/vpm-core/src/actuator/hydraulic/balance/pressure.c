/* Zero of a falling function between low and high, from start: Newton's steps inside of a bracket. f gives the slope besides. */
static double vpm_falling_zero(double (*f)(const double *of, double at, double *slope), const double *of, double start, double low,
                               double high, double near_by)
{
    double at = start >= low && start <= high ? start : 0.5 * (low + high), before = high - low;
    int step;
    for (step = 0; step < 40; ++step) {
        double slope;
        const double value = f(of, at, &slope);
        double next = at - value / slope;
        if (value > 0.0) low = at;
        else high = at;
        if (fabs(next - at) <= near_by) return next;
        if (!(next > low && next < high && fabs(next - at) <= 0.5 * before)) next = 0.5 * (low + high);
        before = fabs(next - at);
        at = next;
    }
    return at;
}

/* Signed root of a pressure drop, laminar around no drop. */
static double vpm_signed_root(double drop, double transition, double *slope)
{
    const double size = fabs(drop), root = sqrt(size < transition ? transition : size), share = drop / transition;
    if (size < transition) {
        *slope = (1.5 - fabs(share)) / root;
        return root * share * (3.0 - fabs(share)) * 0.5;
    }
    *slope = 0.5 / root;
    return drop < 0.0 ? -root : root;
}

/* Net flow into a chamber at a pressure; of: both edges, what is taken, leakage, supply, tank, vapour, transition. */
static double vpm_chamber_flow(const double *of, double pressure, double *slope)
{
    double filling, emptying;
    const double in = vpm_signed_root(of[4] - pressure, of[7], &filling);
    const double out = vpm_signed_root(pressure - of[5], of[7], &emptying);
    *slope = -(of[0] * filling + of[1] * emptying + of[3]);
    return of[0] * in - of[1] * out - of[3] * (pressure - of[5]) - of[2];
}

/* Pressure beyond that of supply or tank, from there, where both edges flow the same way. */
static double vpm_chamber_beyond(double near_by, double away, double share, double range)
{
    const double square = share * share + (near_by * near_by - away * away);
    const double root = (share * share - away * away) / (fabs(share) * near_by + away * sqrt(square > 0.0 ? square : 0.0));
    return range * root * root;
}

/* Pressure in closed form, without leakage and with turbulent edges. */
static double vpm_chamber_turbulent(const double *of)
{
    const double range = of[4] - of[5], share = of[2] / sqrt(range), square = of[0] * of[0] + of[1] * of[1];
    double rest, s;
    if (share > of[0]) return of[5] - vpm_chamber_beyond(of[1], of[0], share, range);
    if (share < -of[1]) return of[4] + vpm_chamber_beyond(of[0], of[1], share, range);
    rest = square - share * share;
    s = (of[0] * sqrt(rest > 0.0 ? rest : 0.0) - of[1] * share) / square;
    return of[5] + range * s * s;
}

/* Pressure of a chamber; of: as above. */
static double vpm_chamber(const double *of, double *slope)
{
    const double wide = of[0] > of[1] ? of[0] : of[1], most = of[4] + of[7] + (of[2] / wide) * (of[2] / wide);
    double found = of[6];
    if (vpm_chamber_flow(of, of[6], slope) <= 0.0) {
        *slope = 0.0;
        return found;
    }
    found = vpm_falling_zero(vpm_chamber_flow, of, vpm_chamber_turbulent(of), of[6], most, 1e-5 * of[4]);
    if (found < of[6]) found = of[6];
    (void)vpm_chamber_flow(of, found, slope);
    *slope = 1.0 / *slope;
    return found;
}

static double vpm_chamber_pressure(double filling, double emptying, double taken, double external, double supply, double tank,
                                   double vapour, double transition)
{
    double of[8], slope;
    of[0] = filling, of[1] = emptying, of[2] = taken, of[3] = external;
    of[4] = supply, of[5] = tank, of[6] = vapour, of[7] = transition;
    return vpm_chamber(of, &slope);
}


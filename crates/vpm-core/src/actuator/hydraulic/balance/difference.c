/* What the difference of two pressures lacks to the one that their leakage is taken at; of: both edges, what is taken from each chamber,
   leakage between them, then as for one chamber. */
static double vpm_chamber_gap(const double *of, double difference, double *slope)
{
    double a[8], b[8], by_a, by_b, gap;
    int k;
    a[0] = b[1] = of[0], a[1] = b[0] = of[1];
    a[2] = of[2] + of[4] * difference, b[2] = of[3] - of[4] * difference;
    for (k = 3; k < 8; ++k) a[k] = b[k] = of[k + 2];
    gap = vpm_chamber(a, &by_a) - vpm_chamber(b, &by_b) - difference;
    *slope = of[4] * (by_a + by_b) - 1.0;
    return gap;
}

static double vpm_chamber_difference(double forward, double backward, double swept_a, double swept_b, double leakage, double external,
                                     double supply, double tank, double vapour, double transition)
{
    double of[10], most, slope;
    if (leakage == 0.0) return 0.0;
    of[0] = forward, of[1] = backward, of[2] = swept_a, of[3] = swept_b, of[4] = leakage;
    of[5] = external, of[6] = supply, of[7] = tank, of[8] = vapour, of[9] = transition;
    most = vpm_chamber_gap(of, 0.0, &slope);
    if (most == 0.0) return 0.0;
    return vpm_falling_zero(vpm_chamber_gap, of, most, most < 0.0 ? most : 0.0, most > 0.0 ? most : 0.0, 1e-5 * supply);
}


/* What moves an instance: steps of co-simulation, rates of model exchange, and derivatives for either. Part of fmu.c. */

/* The state after one communication step of `count` steps in `next`; what went wrong otherwise. */
static fmi3Status advance(Instance *instance, int count, double h)
{
    Memory *now = &instance->now;
    int k, step;
    memcpy(instance->next, now->x, sizeof now->x);
    for (step = 0; step < count; ++step) {
        const double t = now->time + step * h;
        const int ended = FMU_STEP_BY(instance->next, now->u, instance->c, h, instance->w, instance->next);
        if (ended == NAME_ANGLES) return discard(instance, "at %g s a ball joint turns where its angles are no coordinates", t);
        if (ended != NAME_OK) return discard(instance, "at %g s a step of %g s met a singular matrix; take shorter ones", t, h);
        for (k = 0; k < NAME_NX; ++k)
            if (!isfinite(instance->next[k]))
                return discard(instance, "`%s` is no number after %g s; take steps shorter than %g s", NAME_state_names[k], t + h, h);
    }
    return fmi3OK;
}

fmi3Status FMI3(fmi3DoStep)(fmi3Instance given, fmi3Float64 point, fmi3Float64 length, fmi3Boolean no_return, fmi3Boolean *event,
                            fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached)
{
    Instance *instance = given;
    fmi3Status status = allowed(instance, STEPPING, "fmi3DoStep");
    double count;
    (void)no_return;
    if (status != fmi3OK) return status;
    *event = *terminate = *early = fmi3False;
    *reached = instance->now.time;
    /* Times that importers add up are off by rounding. */
    if (!(fabs(point - instance->now.time) <= 1e-9 * fmax(FMU_STEP, fabs(point))))
        return fail(instance, "the step begins at %.17g s, but the machine is at %.17g s; go on from there", point, instance->now.time);
    count = ceil(length / FMU_STEP * (1.0 - 1e-9));
    if (!(length > 0.0) || !(count <= FMU_MOST_STEPS))
        return fail(instance, "a communication step of %g s is not possible; give one above 0 with at most %g steps of %g s", length,
                    FMU_MOST_STEPS, FMU_STEP);
    if (instance->now.has_stop && point + length > instance->now.stop + 1e-9 * fmax(FMU_STEP, fabs(point)))
        return fail(instance, "the step ends at %g s, after the stop time %g s; end there", point + length, instance->now.stop);
    status = advance(instance, (int)count, length / count);
    if (status != fmi3OK) return status;
    memcpy(instance->now.x, instance->next, sizeof instance->next);
    instance->now.time = point + length;
    instance->known = 0;
    *reached = instance->now.time;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetTime)(fmi3Instance given, fmi3Float64 time)
{
    Instance *instance = given;
    fmi3Status status = allowed(instance, EVENTS | CONTINUOUS, "fmi3SetTime");
    if (status != fmi3OK) return status;
    if (!isfinite(time)) return fail(instance, "the time cannot be %g; give a finite number", time);
    instance->now.time = time;
    return fmi3OK;
}

/* fmi3OK where the caller counts states as the machine does. */
static fmi3Status counted(Instance *instance, int modes, size_t count, const char *function)
{
    fmi3Status status = allowed(instance, modes, function);
    if (status != fmi3OK || count == NAME_NX) return status;
    return fail(instance, "%s is asked for %lu states, but the machine has %d", function, (unsigned long)count, NAME_NX);
}

fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance given, const fmi3Float64 states[], size_t count)
{
    int k;
    Instance *instance = given;
    fmi3Status status = counted(instance, CONTINUOUS, count, "fmi3SetContinuousStates");
    if (status != fmi3OK) return status;
    for (k = 0; k < NAME_NX; ++k)
        if (!isfinite(states[k]))
            return discard(instance, "`%s` cannot be %g; the solver has left all bounds", NAME_state_names[k], states[k]);
    memcpy(instance->now.x, states, NAME_NX * sizeof states[0]);
    instance->known = 0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3GetContinuousStates)(fmi3Instance given, fmi3Float64 states[], size_t count)
{
    const Instance *instance = given;
    fmi3Status status = counted(given, ALIVE, count, "fmi3GetContinuousStates");
    if (status == fmi3OK) memcpy(states, instance->now.x, NAME_NX * sizeof states[0]);
    return status;
}

fmi3Status FMI3(fmi3GetContinuousStateDerivatives)(fmi3Instance given, fmi3Float64 derivatives[], size_t count)
{
    int k;
    Instance *instance = given;
    fmi3Status status = counted(instance, RUNNING | TERMINATED, count, "fmi3GetContinuousStateDerivatives");
    if (status != fmi3OK) return status;
    work_out(instance, RATES);
    for (k = 0; k < NAME_NX; ++k) {
        derivatives[k] = instance->dx[k];
        if (status == fmi3OK && !isfinite(derivatives[k]))
            status = discard(instance, "the rate of `%s` is no number at %g s; the state is out of what the laws hold for",
                             NAME_state_names[k], instance->now.time);
    }
    return status;
}

fmi3Status FMI3(fmi3GetNominalsOfContinuousStates)(fmi3Instance given, fmi3Float64 nominals[], size_t count)
{
    int k;
    fmi3Status status = counted(given, ALIVE, count, "fmi3GetNominalsOfContinuousStates");
    for (k = 0; status == fmi3OK && k < NAME_NX; ++k) nominals[k] = 1.0;
    return status;
}

fmi3Status FMI3(fmi3GetNumberOfContinuousStates)(fmi3Instance given, size_t *count)
{
    *count = NAME_NX;
    return allowed(given, ALIVE, "fmi3GetNumberOfContinuousStates");
}

fmi3Status FMI3(fmi3GetNumberOfEventIndicators)(fmi3Instance given, size_t *count)
{
    *count = 0;
    return allowed(given, ALIVE, "fmi3GetNumberOfEventIndicators");
}

fmi3Status FMI3(fmi3GetEventIndicators)(fmi3Instance given, fmi3Float64 indicators[], size_t count)
{
    fmi3Status status = allowed(given, ALIVE, "fmi3GetEventIndicators");
    (void)indicators;
    return status == fmi3OK && count > 0 ? fail(given, "the machine has no event indicators; ask for none") : status;
}

fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance given, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate)
{
    (void)no_return;
    *event = *terminate = fmi3False;
    return allowed(given, CONTINUOUS, "fmi3CompletedIntegratorStep");
}

fmi3Status FMI3(fmi3EvaluateDiscreteStates)(fmi3Instance given)
{
    return allowed(given, INITIALIZING | EVENTS, "fmi3EvaluateDiscreteStates");
}

fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance given, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                          fmi3Boolean *states, fmi3Boolean *has_next, fmi3Float64 *next)
{
    *again = *terminate = *nominals = *states = *has_next = fmi3False;
    *next = 0.0;
    return allowed(given, EVENTS, "fmi3UpdateDiscreteStates");
}

/* Adds the matrix times `from`, or `from` times the matrix. */
static void multiply(const casadi_int *pattern, const double *entries, bool adjoint, const double *from, double *to)
{
    const casadi_int columns = pattern[1], *first = pattern + 2, *row = first + columns + 1;
    casadi_int j, k;
    for (j = 0; j < columns; ++j)
        for (k = first[j]; k < first[j + 1]; ++k) {
            if (adjoint) to[j] += entries[k] * from[row[k]];
            else to[row[k]] += entries[k] * from[j];
        }
}

static void product(Instance *m, bool adjoint, int jacobians)
{
    static const casadi_int *const patterns[2][3] = {{NAME_rates_by_x, NAME_rates_by_u, NAME_rates_by_p},
                                                     {NAME_outputs_by_x, NAME_outputs_by_u, NAME_outputs_by_p}};
    static const int wanted[] = {RATES_JACOBIAN, OUTPUTS_JACOBIAN}, unknown[] = {FIRST_RATE, FIRST_OUTPUT};
    static const int known[] = {FIRST_STATE, FIRST_INPUT, FIRST_PARAMETER};
    const double *entries[2][3] = {{m->dx_x, m->dx_u, m->dx_p}, {m->y_x, m->y_u, m->y_p}};
    int i, j;
    work_out(m, jacobians);
    memset(m->found, 0, sizeof m->found);
    for (i = 0; i < 2; ++i)
        for (j = 0; j < 3 && (jacobians & wanted[i]); ++j)
            multiply(patterns[i][j], entries[i][j], adjoint, m->given + (adjoint ? unknown[i] : known[j]),
                     m->found + (adjoint ? known[j] : unknown[i]));
}

static fmi3Status derivative(Instance *m, bool adjoint, const fmi3ValueReference unknowns[], size_t rows, const fmi3ValueReference knowns[],
                             size_t columns, const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t length)
{
    const fmi3ValueReference *from = adjoint ? unknowns : knowns, *to = adjoint ? knowns : unknowns;
    int place, jacobians = 0;
    size_t k;
    fmi3Status status = allowed(m, RUNNING | TERMINATED, "a derivative");
    if (status != fmi3OK) return status;
    if (seeds != (adjoint ? rows : columns) || length != (adjoint ? columns : rows))
        return fail(m, "%lu seeds and %lu sensitivities do not fit %lu unknowns and %lu knowns", (unsigned long)seeds, (unsigned long)length,
                    (unsigned long)rows, (unsigned long)columns);
    for (k = 0; k < rows; ++k) {
        const Kind kind = find(unknowns[k], &place);
        if (kind != RATE && kind != OUTPUT) return fail(m, "reference %lu is no unknown; name a rate or an output", (unsigned long)unknowns[k]);
        jacobians |= kind == RATE ? RATES_JACOBIAN : OUTPUTS_JACOBIAN;
    }
    for (k = 0; k < columns; ++k) {
        const Kind kind = find(knowns[k], &place);
        if (kind == RATE || kind == OUTPUT || kind == NO_KIND)
            return fail(m, "reference %lu is no known; name an input, a state or a parameter", (unsigned long)knowns[k]);
    }
    memset(m->given, 0, sizeof m->given);
    for (k = 0; k < seeds; ++k) m->given[from[k]] += seed[k];
    product(m, adjoint, jacobians);
    for (k = 0; k < length; ++k) {
        sensitivity[k] = m->found[to[k]];
        if (status == fmi3OK && !isfinite(sensitivity[k]))
            status = discard(m, "a derivative is no number at %g s; the state is out of what the laws hold for", m->now.time);
    }
    return status;
}

fmi3Status FMI3(fmi3GetDirectionalDerivative)(fmi3Instance given, const fmi3ValueReference unknowns[], size_t rows,
                                              const fmi3ValueReference knowns[], size_t columns, const fmi3Float64 seed[], size_t seeds,
                                              fmi3Float64 sensitivity[], size_t length)
{
    return derivative(given, false, unknowns, rows, knowns, columns, seed, seeds, sensitivity, length);
}

fmi3Status FMI3(fmi3GetAdjointDerivative)(fmi3Instance given, const fmi3ValueReference unknowns[], size_t rows,
                                          const fmi3ValueReference knowns[], size_t columns, const fmi3Float64 seed[], size_t seeds,
                                          fmi3Float64 sensitivity[], size_t length)
{
    return derivative(given, true, unknowns, rows, knowns, columns, seed, seeds, sensitivity, length);
}

/* A machine as an FMU of FMI 3.0, for model exchange and co-simulation, on its equations in NAME.c.

   All memory of an instance is asked for when it is made; what FMI lets its importer keep (fmi3GetFMUState) is the importer's. There are no
   variables but those of instances. After fmi3Error an instance waits for fmi3Reset, fmi3SetFMUState or fmi3FreeInstance; after fmi3Discard it
   is where it was before the call. */
#include "fmi3.h"
#include "NAME.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

SETTINGS
/* Where the value references of each kind begin. */
enum {
    FIRST_INPUT = 1,
    FIRST_STATE = FIRST_INPUT + NAME_NU,
    FIRST_RATE = FIRST_STATE + NAME_NX,
    FIRST_OUTPUT = FIRST_RATE + NAME_NX,
    FIRST_PARAMETER = FIRST_OUTPUT + NAME_NY,
    VARIABLES = FIRST_PARAMETER + NAME_NP
};

typedef enum { TIME, INPUT, STATE, RATE, OUTPUT, PARAMETER, NO_KIND } Kind;

enum { INSTANTIATED = 1, INITIALIZING = 2, EVENTS = 4, CONTINUOUS = 8, STEPPING = 16, TERMINATED = 32, FAILED = 64 };
enum { RUNNING = INITIALIZING | EVENTS | CONTINUOUS | STEPPING, ALIVE = RUNNING | INSTANTIATED | TERMINATED };

/* All that an instance remembers; arrays that C does not know empty have an entry more. */
typedef struct {
    int64_t mode, has_stop;
    double time, stop, x[NAME_NX + 1], u[NAME_NU + 1], p[NAME_NP + 1];
} Memory;

/* What is worked out from it. */
enum { RATES = 1, OUTPUTS = 2, RATES_JACOBIAN = 4, OUTPUTS_JACOBIAN = 8 };

typedef struct {
    Memory now;
    bool exchange;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int known;
    double c[NAME_NC + 1], w[NAME_NW + 1], next[NAME_NX + 1], dx[NAME_NX + 1], y[NAME_NY + 1];
    double dx_x[NAME_NNZ_RATES_X + 1], dx_u[NAME_NNZ_RATES_U + 1], dx_p[NAME_NNZ_RATES_P + 1];
    double y_x[NAME_NNZ_OUTPUTS_X + 1], y_u[NAME_NNZ_OUTPUTS_U + 1], y_p[NAME_NNZ_OUTPUTS_P + 1];
    double given[VARIABLES + 1], found[VARIABLES + 1];
} Instance;

static void tell(const Instance *instance, fmi3Status status, const char *format, va_list values)
{
    char text[400];
    if (instance->log == NULL) return;
    vsnprintf(text, sizeof text, format, values);
    instance->log(instance->environment, status, status == fmi3Discard ? "logStatusDiscard" : "logStatusError", text);
}

static fmi3Status fail(Instance *instance, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    tell(instance, fmi3Error, format, values);
    va_end(values);
    instance->now.mode = FAILED;
    return fmi3Error;
}

static fmi3Status discard(const Instance *instance, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    tell(instance, fmi3Discard, format, values);
    va_end(values);
    return fmi3Discard;
}

/* fmi3OK where an instance may be asked this in its mode. */
static fmi3Status allowed(Instance *instance, int modes, const char *function)
{
    if (instance == NULL) return fmi3Error;
    if (instance->now.mode & modes) return fmi3OK;
    if (instance->now.mode == FAILED) return fail(instance, "%s is called after an error; call fmi3Reset first", function);
    return fail(instance, "%s is called in a mode that has no such function; call it in the order of FMI 3.0", function);
}

static Kind find(fmi3ValueReference reference, int *place)
{
    static const fmi3ValueReference first[] = {0, FIRST_INPUT, FIRST_STATE, FIRST_RATE, FIRST_OUTPUT, FIRST_PARAMETER, VARIABLES};
    int kind = TIME;
    while (kind < NO_KIND && reference >= first[kind + 1]) ++kind;
    *place = (int)(reference - first[kind]);
    return (Kind)kind;
}

static const char *name_of(Kind kind, int place)
{
    return kind == INPUT ? NAME_input_names[place] : kind == PARAMETER ? NAME_parameter_names[place]
         : kind == OUTPUT ? NAME_output_names[place] : kind == TIME ? "time" : NAME_state_names[place];
}

static void prepare(Instance *instance)
{
    NAME_prepare(instance->now.p, instance->w, instance->c);
    instance->known = 0;
}

static void begin(Instance *instance)
{
    Memory *now = &instance->now;
    memset(now, 0, sizeof *now);
    now->mode = INSTANTIATED;
    memcpy(now->x, FMU_STATES, sizeof now->x);
    memcpy(now->u, FMU_INPUTS, sizeof now->u);
    memcpy(now->p, NAME_parameters, NAME_NP * sizeof now->p[0]);
    prepare(instance);
}

static Instance *made(fmi3String token, bool exchange, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    Instance *instance = calloc(1, sizeof *instance);
    if (instance == NULL) {
        if (log != NULL) log(environment, fmi3Error, "logStatusError", "there is no memory for an instance; free some");
        return NULL;
    }
    instance->exchange = exchange;
    instance->environment = environment;
    instance->log = log;
    if (token == NULL || strcmp(token, FMU_TOKEN) != 0) {
        fail(instance, "the instantiation token is %.60s, but the library was made for %s; take both out of one FMU",
             token == NULL ? "none" : token, FMU_TOKEN);
        free(instance);
        return NULL;
    }
    begin(instance);
    return instance;
}

const char *FMI3(fmi3GetVersion)(void)
{
    return "3.0";
}

fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance given, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    size_t k;
    fmi3Status status = allowed(given, ALIVE, "fmi3SetDebugLogging");
    (void)on;
    /* There is nothing to debug: errors and refusals are always told. */
    for (k = 0; status == fmi3OK && k < count; ++k)
        if (strcmp(categories[k], "logStatusError") != 0 && strcmp(categories[k], "logStatusDiscard") != 0)
            status = fail(given, "there is no log category %.60s; name logStatusError or logStatusDiscard", categories[k]);
    return status;
}

fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    return made(token, true, environment, log);
}

fmi3Instance FMI3(fmi3InstantiateCoSimulation)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                               const fmi3ValueReference intermediate[], size_t count,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3IntermediateUpdateCallback update)
{
    Instance *instance = made(token, false, environment, log);
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate, (void)count, (void)update;
    if (instance != NULL && event_mode) {
        fail(instance, "co-simulation of this machine has no event mode; instantiate it without");
        free(instance);
        return NULL;
    }
    return instance;
}

void FMI3(fmi3FreeInstance)(fmi3Instance instance)
{
    free(instance);
}

fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance given, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
                                             fmi3Boolean has_stop, fmi3Float64 stop)
{
    Instance *instance = given;
    fmi3Status status = allowed(instance, INSTANTIATED, "fmi3EnterInitializationMode");
    (void)has_tolerance, (void)tolerance;
    if (status != fmi3OK) return status;
    if (!isfinite(start) || (has_stop && !(stop > start)))
        return fail(instance, "start time %g s and stop time %g s are none; give finite times, one after the other", start, stop);
    instance->now.time = start;
    instance->now.has_stop = has_stop ? 1 : 0;
    instance->now.stop = has_stop ? stop : 0.0;
    instance->now.mode = INITIALIZING;
    return fmi3OK;
}

static fmi3Status to_mode(Instance *instance, int from, int mode, const char *function)
{
    fmi3Status status = allowed(instance, from, function);
    if (status == fmi3OK) instance->now.mode = mode;
    return status;
}

fmi3Status FMI3(fmi3ExitInitializationMode)(fmi3Instance given)
{
    const Instance *instance = given;
    return to_mode(given, INITIALIZING, instance != NULL && instance->exchange ? EVENTS : STEPPING, "fmi3ExitInitializationMode");
}

fmi3Status FMI3(fmi3EnterEventMode)(fmi3Instance given)
{
    return to_mode(given, CONTINUOUS, EVENTS, "fmi3EnterEventMode");
}

fmi3Status FMI3(fmi3EnterContinuousTimeMode)(fmi3Instance given)
{
    return to_mode(given, EVENTS, CONTINUOUS, "fmi3EnterContinuousTimeMode");
}

fmi3Status FMI3(fmi3Terminate)(fmi3Instance given)
{
    return to_mode(given, RUNNING, TERMINATED, "fmi3Terminate");
}

fmi3Status FMI3(fmi3Reset)(fmi3Instance given)
{
    fmi3Status status = allowed(given, ALIVE | FAILED, "fmi3Reset");
    if (status == fmi3OK) begin(given);
    return status;
}

/* Rates, outputs and their derivatives where the instance is; `wanted` of them, each worked out once. */
static void work_out(Instance *m, int wanted)
{
    const int missing = wanted & ~m->known;
    if (missing & RATES) NAME_evaluate_rates(m->now.x, m->now.u, m->c, m->w, m->dx);
    if (missing & OUTPUTS) NAME_evaluate_outputs(m->now.x, m->now.u, m->c, m->w, m->y);
    if (missing & RATES_JACOBIAN) NAME_evaluate_rates_jacobian(m->now.x, m->now.u, m->c, m->w, m->dx, m->dx_x, m->dx_u, m->dx_p);
    if (missing & OUTPUTS_JACOBIAN) NAME_evaluate_outputs_jacobian(m->now.x, m->now.u, m->c, m->w, m->y, m->y_x, m->y_u, m->y_p);
    m->known |= wanted;
}

static double value_of(Instance *instance, Kind kind, int place)
{
    if (kind == RATE || kind == OUTPUT) work_out(instance, kind == RATE ? RATES : OUTPUTS);
    return kind == TIME ? instance->now.time : kind == INPUT ? instance->now.u[place] : kind == STATE ? instance->now.x[place]
         : kind == RATE ? instance->dx[place] : kind == OUTPUT ? instance->y[place] : instance->now.p[place];
}

fmi3Status FMI3(fmi3GetFloat64)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3Float64 values[], size_t length)
{
    size_t k;
    Instance *instance = given;
    fmi3Status status = allowed(instance, ALIVE, "fmi3GetFloat64");
    if (status == fmi3OK && length != count)
        return fail(instance, "%lu variables have one number each, not %lu", (unsigned long)count, (unsigned long)length);
    for (k = 0; status == fmi3OK && k < count; ++k) {
        int place;
        const Kind kind = find(references[k], &place);
        if (kind == NO_KIND) return fail(instance, "there is no variable of reference %lu", (unsigned long)references[k]);
        values[k] = value_of(instance, kind, place);
        if (!isfinite(values[k]))
            status = discard(instance, "%s of `%s` is no number at %g s; the state is out of what the laws hold for",
                             kind == RATE ? "the rate" : "the value", name_of(kind, place), instance->now.time);
    }
    return status;
}

static fmi3Status set(Instance *instance, fmi3ValueReference reference, double value)
{
    static const int modes[] = {0, ALIVE & ~TERMINATED, INSTANTIATED | INITIALIZING, 0, 0, INSTANTIATED | INITIALIZING | EVENTS | STEPPING};
    int place;
    const Kind kind = find(reference, &place);
    if (kind == NO_KIND) return fail(instance, "there is no variable of reference %lu", (unsigned long)reference);
    if (!(instance->now.mode & modes[kind])) return fail(instance, "`%s` cannot be set now", name_of(kind, place));
    if (!isfinite(value)) return fail(instance, "`%s` cannot be %g; give a finite number", name_of(kind, place), value);
    if (kind == PARAMETER && !(value >= FMU_LEAST[place] && value <= FMU_MOST[place]))
        return fail(instance, "`%s` cannot be %g; give a number from %g to %g", name_of(kind, place), value, FMU_LEAST[place], FMU_MOST[place]);
    (kind == INPUT ? instance->now.u : kind == STATE ? instance->now.x : instance->now.p)[place] = value;
    instance->known = 0;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetFloat64)(fmi3Instance given, const fmi3ValueReference references[], size_t count, const fmi3Float64 values[],
                                size_t length)
{
    size_t k;
    bool prepared = true;
    Instance *instance = given;
    fmi3Status status = allowed(instance, ALIVE, "fmi3SetFloat64");
    if (status == fmi3OK && length != count)
        return fail(instance, "%lu variables have one number each, not %lu", (unsigned long)count, (unsigned long)length);
    for (k = 0; status == fmi3OK && k < count; ++k) {
        status = set(instance, references[k], values[k]);
        prepared = prepared && references[k] < FIRST_PARAMETER;
    }
    if (status == fmi3OK && !prepared) prepare(instance);
    return status;
}

#include "fmu_steps.h"
#include "fmu_keeping.h"
#include "fmu_absent.h"

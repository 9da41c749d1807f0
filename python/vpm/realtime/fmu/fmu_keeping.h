/* Where an instance is, kept by its importer and taken to other processes. Part of fmu.c. */

/* Kept memory, marked with the machine that it is of. */
typedef struct {
    char token[sizeof FMU_TOKEN];
    Memory memory;
} Kept;

/* Whether this is a memory that an instance of this kind can have had; bytes from outside may be any. */
static bool possible(const Instance *instance, const Memory *memory)
{
    const int64_t mode = memory->mode;
    int k;
    bool known = mode == INSTANTIATED || mode == INITIALIZING || mode == TERMINATED ||
                 (instance->exchange ? mode == EVENTS || mode == CONTINUOUS : mode == STEPPING);
    known = known && (memory->has_stop == 0 || memory->has_stop == 1) && isfinite(memory->time) && isfinite(memory->stop);
    for (k = 0; k < NAME_NX; ++k) known = known && isfinite(memory->x[k]);
    for (k = 0; k < NAME_NU; ++k) known = known && isfinite(memory->u[k]);
    for (k = 0; k < NAME_NP; ++k) known = known && memory->p[k] >= FMU_LEAST[k] && memory->p[k] <= FMU_MOST[k];
    return known;
}

/* Memory for a state that is kept: what the importer has, or more. */
static Kept *kept(fmi3FMUState *state)
{
    if (*state == NULL) *state = calloc(1, sizeof(Kept));
    return *state;
}

fmi3Status FMI3(fmi3GetFMUState)(fmi3Instance given, fmi3FMUState *state)
{
    Instance *instance = given;
    fmi3Status status = allowed(instance, ALIVE, "fmi3GetFMUState");
    Kept *keep = status == fmi3OK ? kept(state) : NULL;
    if (status != fmi3OK) return status;
    if (keep == NULL) return fail(instance, "there is no memory to keep a state in; free some");
    memcpy(keep->token, FMU_TOKEN, sizeof keep->token);
    memcpy(&keep->memory, &instance->now, sizeof keep->memory);
    return fmi3OK;
}

fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance given, fmi3FMUState state)
{
    Instance *instance = given;
    const Kept *keep = state;
    fmi3Status status = allowed(instance, ALIVE | FAILED, "fmi3SetFMUState");
    if (status != fmi3OK) return status;
    if (keep == NULL || memcmp(keep->token, FMU_TOKEN, sizeof keep->token) != 0 || !possible(instance, &keep->memory))
        return fail(instance, "the state that was kept is none of this kind of instance; keep one of its own");
    memcpy(&instance->now, &keep->memory, sizeof instance->now);
    prepare(instance);
    return fmi3OK;
}

fmi3Status FMI3(fmi3FreeFMUState)(fmi3Instance given, fmi3FMUState *state)
{
    fmi3Status status = allowed(given, ALIVE | FAILED, "fmi3FreeFMUState");
    if (status != fmi3OK || state == NULL) return status;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance given, fmi3FMUState state, size_t *size)
{
    (void)state;
    *size = sizeof(Kept);
    return allowed(given, ALIVE, "fmi3SerializedFMUStateSize");
}

fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance given, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    fmi3Status status = allowed(given, ALIVE, "fmi3SerializeFMUState");
    if (status != fmi3OK) return status;
    if (state == NULL || size < sizeof(Kept))
        return fail(given, "a state takes %lu bytes, not %lu", (unsigned long)sizeof(Kept), (unsigned long)size);
    memcpy(bytes, state, sizeof(Kept));
    return fmi3OK;
}

fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance given, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    Instance *instance = given;
    Kept read;
    fmi3Status status = allowed(instance, ALIVE, "fmi3DeserializeFMUState");
    if (status != fmi3OK) return status;
    if (size != sizeof read) return fail(instance, "a state has %lu bytes, not %lu", (unsigned long)sizeof read, (unsigned long)size);
    memcpy(&read, bytes, sizeof read);
    if (memcmp(read.token, FMU_TOKEN, sizeof read.token) != 0 || !possible(instance, &read.memory))
        return fail(instance, "the bytes are no state of this kind of instance; take those of fmi3SerializeFMUState");
    if (kept(state) == NULL) return fail(instance, "there is no memory to keep a state in; free some");
    memcpy(*state, &read, sizeof read);
    return fmi3OK;
}

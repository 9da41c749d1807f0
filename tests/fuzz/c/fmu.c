/* An FMU called as an importer calls it, rightly and with hostile numbers. Compiled with the FMU's sources, with
   -DTOKEN=... and -DRATE=..., the reference of its first rate. With -DCOUNTED allocations are counted, by the GNU library. */
#include "fmi3.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int stepping = 0, allocations = 0;

static unsigned long long dice = 0x9E3779B97F4A7C15ULL;

static double number(void)
{
    static const double hostile[] = {0.0, -0.0, 1e-300, -1e155, 1e308, 5e-324, INFINITY, -INFINITY, NAN, 1e19, -1e19};
    dice ^= dice << 13;
    dice ^= dice >> 7;
    dice ^= dice << 17;
    return dice % 4 == 0 ? hostile[(dice >> 8) % (sizeof hostile / sizeof hostile[0])] : (double)(dice >> 40) / 16777216.0 - 0.5;
}

static void log_message(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)status, (void)category;
    if (strlen(message) > 399) abort();
}

static void steps(fmi3Instance instance, int count, int hostile)
{
    fmi3ValueReference reference;
    const fmi3ValueReference state = THE_RATE - 1, rate = THE_RATE;
    fmi3Boolean event, terminate, early;
    double value, time = 0.0, one = 1.0;
    int k;
    for (k = 0; k < count; ++k) {
        for (reference = 0; reference < (hostile ? 2u * THE_RATE : THE_RATE); ++reference) {
            (void)fmi3GetFloat64(instance, &reference, 1, &value, 1);
            if (hostile) value = number(), (void)fmi3SetFloat64(instance, &reference, 1, &value, 1);
        }
        (void)fmi3GetDirectionalDerivative(instance, &rate, 1, &state, 1, &one, 1, &value, 1);
        (void)fmi3DoStep(instance, hostile ? number() : time, hostile ? number() : 1e-3, true, &event, &terminate, &early, &value);
        time += 1e-3;
    }
}

/* Damaged bytes of a state are refused, or are a state. */
static void keeping(fmi3Instance instance)
{
    fmi3FMUState state = NULL, read = NULL;
    size_t size, k;
    fmi3Byte *bytes;
    if (fmi3GetFMUState(instance, &state) != fmi3OK) abort();
    if (fmi3SerializedFMUStateSize(instance, state, &size) != fmi3OK) abort();
    bytes = malloc(size);
    for (k = 0; k < size; ++k) {
        if (fmi3SerializeFMUState(instance, state, bytes, size) != fmi3OK) abort();
        bytes[k] ^= (fmi3Byte)(1u << (k % 8));
        if (fmi3DeserializeFMUState(instance, bytes, size, &read) == fmi3OK) (void)fmi3SetFMUState(instance, read);
        if (fmi3SetFMUState(instance, state) != fmi3OK) abort();
    }
    free(bytes);
    (void)fmi3FreeFMUState(instance, &state);
    (void)fmi3FreeFMUState(instance, &read);
}

static fmi3Instance begun(void)
{
    fmi3Instance instance = fmi3InstantiateCoSimulation("one", TOKEN, "", false, true, false, false, NULL, 0, NULL, log_message, NULL);
    if (instance == NULL || fmi3EnterInitializationMode(instance, false, 0.0, 0.0, false, 0.0) != fmi3OK) abort();
    if (fmi3ExitInitializationMode(instance) != fmi3OK) abort();
    return instance;
}

#ifdef COUNTED
extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);

void *malloc(size_t size)
{
    allocations += stepping;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    allocations += stepping;
    return __libc_calloc(count, size);
}
#endif

int main(void)
{
    int round;
    fmi3Instance instance = begun();
    stepping = 1;
    steps(instance, 100, 0);
    stepping = 0;
    printf("%d\n", allocations);
    if (fmi3Terminate(instance) != fmi3OK) abort();
    fmi3FreeInstance(instance);
    for (round = 0; round < 100; ++round) {
        instance = begun();
        steps(instance, 5, 1);
        if (fmi3Reset(instance) != fmi3OK) abort();
        keeping(instance);
        fmi3FreeInstance(instance);
    }
#ifdef COUNTED
    allocations = 0;
    stepping = 1;
    fmi3FreeInstance(begun());
    stepping = 0;
    printf("%d\n", allocations);
#endif
    return 0;
}

/* What FMI 3.0 has and a machine has not: variables that are no numbers, clocks, configurations. Part of fmu.c. */

static fmi3Status absent(Instance *instance, size_t count, const char *function)
{
    fmi3Status status = allowed(instance, ALIVE, function);
    return status == fmi3OK && count > 0 ? fail(instance, "%s finds nothing: all variables are Float64, without clocks", function) : status;
}

#define ABSENT(Type) \
    fmi3Status FMI3(fmi3Get##Type)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3##Type values[], size_t n) \
    { \
        (void)references, (void)values, (void)n; \
        return absent(given, count, "fmi3Get" #Type); \
    } \
    fmi3Status FMI3(fmi3Set##Type)(fmi3Instance given, const fmi3ValueReference references[], size_t count, const fmi3##Type values[], \
                                   size_t n) \
    { \
        (void)references, (void)values, (void)n; \
        return absent(given, count, "fmi3Set" #Type); \
    }

ABSENT(Float32)
ABSENT(Int8)
ABSENT(UInt8)
ABSENT(Int16)
ABSENT(UInt16)
ABSENT(Int32)
ABSENT(UInt32)
ABSENT(Int64)
ABSENT(UInt64)
ABSENT(Boolean)
ABSENT(String)

fmi3Status FMI3(fmi3GetBinary)(fmi3Instance given, const fmi3ValueReference references[], size_t count, size_t sizes[],
                               fmi3Binary values[], size_t n)
{
    (void)references, (void)sizes, (void)values, (void)n;
    return absent(given, count, "fmi3GetBinary");
}

fmi3Status FMI3(fmi3SetBinary)(fmi3Instance given, const fmi3ValueReference references[], size_t count, const size_t sizes[],
                               const fmi3Binary values[], size_t n)
{
    (void)references, (void)sizes, (void)values, (void)n;
    return absent(given, count, "fmi3SetBinary");
}

fmi3Status FMI3(fmi3GetClock)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3Clock values[])
{
    (void)references, (void)values;
    return absent(given, count, "fmi3GetClock");
}

fmi3Status FMI3(fmi3SetClock)(fmi3Instance given, const fmi3ValueReference references[], size_t count, const fmi3Clock values[])
{
    (void)references, (void)values;
    return absent(given, count, "fmi3SetClock");
}

fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3Float64 intervals[],
                                        fmi3IntervalQualifier qualifiers[])
{
    (void)references, (void)intervals, (void)qualifiers;
    return absent(given, count, "fmi3GetIntervalDecimal");
}

fmi3Status FMI3(fmi3GetIntervalFraction)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
                                         fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)references, (void)counters, (void)resolutions, (void)qualifiers;
    return absent(given, count, "fmi3GetIntervalFraction");
}

fmi3Status FMI3(fmi3GetShiftDecimal)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3Float64 shifts[])
{
    (void)references, (void)shifts;
    return absent(given, count, "fmi3GetShiftDecimal");
}

fmi3Status FMI3(fmi3GetShiftFraction)(fmi3Instance given, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
                                      fmi3UInt64 resolutions[])
{
    (void)references, (void)counters, (void)resolutions;
    return absent(given, count, "fmi3GetShiftFraction");
}

#define ABSENT_SETTING(Name) \
    fmi3Status FMI3(fmi3Set##Name##Decimal)(fmi3Instance given, const fmi3ValueReference references[], size_t count, \
                                            const fmi3Float64 values[]) \
    { \
        (void)references, (void)values; \
        return absent(given, count, "fmi3Set" #Name "Decimal"); \
    } \
    fmi3Status FMI3(fmi3Set##Name##Fraction)(fmi3Instance given, const fmi3ValueReference references[], size_t count, \
                                             const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) \
    { \
        (void)references, (void)counters, (void)resolutions; \
        return absent(given, count, "fmi3Set" #Name "Fraction"); \
    }

ABSENT_SETTING(Interval)
ABSENT_SETTING(Shift)

fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance given, const fmi3ValueReference references[], size_t count, const fmi3Int32 orders[],
                                          fmi3Float64 values[], size_t n)
{
    (void)references, (void)orders, (void)values, (void)n;
    return absent(given, count, "fmi3GetOutputDerivatives");
}

fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance given, fmi3ValueReference reference, size_t *count)
{
    (void)reference, (void)count;
    return absent(given, 1, "fmi3GetNumberOfVariableDependencies");
}

fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance given, fmi3ValueReference dependent, size_t elements[],
                                             fmi3ValueReference independents[], size_t others[], fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent, (void)elements, (void)independents, (void)others, (void)kinds, (void)n;
    return absent(given, 1, "fmi3GetVariableDependencies");
}

fmi3Status FMI3(fmi3EnterConfigurationMode)(fmi3Instance given)
{
    return absent(given, 1, "fmi3EnterConfigurationMode");
}

fmi3Status FMI3(fmi3ExitConfigurationMode)(fmi3Instance given)
{
    return absent(given, 1, "fmi3ExitConfigurationMode");
}

fmi3Status FMI3(fmi3EnterStepMode)(fmi3Instance given)
{
    return absent(given, 1, "fmi3EnterStepMode");
}

fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance given, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock, (void)time;
    return absent(given, 1, "fmi3ActivateModelPartition");
}

fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                     fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                     fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                                     fmi3UnlockPreemptionCallback unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log != NULL) log(environment, fmi3Error, "logStatusError", "the machine has no clocks; take model exchange or co-simulation");
    return NULL;
}

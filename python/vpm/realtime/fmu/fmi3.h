/* The interface of FMI 3.0 (https://fmi-standard.org): its types, its values and its functions, as far as this machine needs to name them.
   The types stand aside where the standard's own headers were included before; the functions are then checked against those. */
#ifndef NAME_FMI3_H
#define NAME_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef fmi3PlatformTypes_h
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
#define fmi3True true
#define fmi3False false
#endif

#ifndef fmi3FunctionTypes_h
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);
#endif

/* Machines that are linked together into one program begin the names of their functions with NAME_, as FMI 3.0 (section 2.2.2) asks of
   sources; a shared library is compiled with -DFMI3_OVERRIDE_FUNCTION_PREFIX and has the plain names. */
#ifndef fmi3Functions_h
#ifndef FMI3_OVERRIDE_FUNCTION_PREFIX
#ifndef FMI3_FUNCTION_PREFIX
#define FMI3_FUNCTION_PREFIX NAME_
#endif
#define FMI3_JOIN_(prefix, name) prefix##name
#define FMI3_JOIN(prefix, name) FMI3_JOIN_(prefix, name)
#define FMI3(name) FMI3_JOIN(FMI3_FUNCTION_PREFIX, name)
#endif
#ifndef FMI3_Export
#if defined(FMI3) || !(defined(_WIN32) || defined(__GNUC__))
#define FMI3_Export
#elif defined(_WIN32)
#define FMI3_Export __declspec(dllexport)
#else
#define FMI3_Export __attribute__((visibility("default")))
#endif
#endif
#endif
#ifndef FMI3
#define FMI3(name) name
#endif

/* Functions of one signature are declared by one line. */
typedef fmi3Status NAME_Plain(fmi3Instance);
typedef fmi3Status NAME_Numbers(fmi3Instance, fmi3Float64[], size_t);
typedef fmi3Status NAME_Count(fmi3Instance, size_t *);
typedef fmi3Status NAME_Keep(fmi3Instance, fmi3FMUState *);
typedef fmi3Status NAME_Derivative(fmi3Instance, const fmi3ValueReference unknowns[], size_t, const fmi3ValueReference knowns[], size_t,
                                   const fmi3Float64 seed[], size_t, fmi3Float64 sensitivity[], size_t);
typedef fmi3Status NAME_Decimals(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[]);
typedef fmi3Status NAME_Fractions(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[], fmi3UInt64[]);
typedef fmi3Status NAME_GivenDecimals(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Float64[]);
typedef fmi3Status NAME_GivenFractions(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3UInt64[], const fmi3UInt64[]);
#define VALUES(Type) \
    FMI3_Export fmi3Status FMI3(fmi3Get##Type)(fmi3Instance, const fmi3ValueReference[], size_t, fmi3##Type[], size_t); \
    FMI3_Export fmi3Status FMI3(fmi3Set##Type)(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3##Type[], size_t);

FMI3_Export const char *FMI3(fmi3GetVersion)(void);
FMI3_Export fmi3Status FMI3(fmi3SetDebugLogging)(fmi3Instance, fmi3Boolean, size_t, const fmi3String[]);

FMI3_Export fmi3Instance FMI3(fmi3InstantiateModelExchange)(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                                            fmi3InstanceEnvironment, fmi3LogMessageCallback);
FMI3_Export fmi3Instance FMI3(fmi3InstantiateCoSimulation)(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                                           fmi3Boolean, const fmi3ValueReference[], size_t, fmi3InstanceEnvironment,
                                                           fmi3LogMessageCallback, fmi3IntermediateUpdateCallback);
FMI3_Export fmi3Instance FMI3(fmi3InstantiateScheduledExecution)(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean,
                                                                 fmi3InstanceEnvironment, fmi3LogMessageCallback, fmi3ClockUpdateCallback,
                                                                 fmi3LockPreemptionCallback, fmi3UnlockPreemptionCallback);
FMI3_Export void FMI3(fmi3FreeInstance)(fmi3Instance);

FMI3_Export fmi3Status FMI3(fmi3EnterInitializationMode)(fmi3Instance, fmi3Boolean, fmi3Float64, fmi3Float64, fmi3Boolean, fmi3Float64);
FMI3_Export NAME_Plain FMI3(fmi3ExitInitializationMode), FMI3(fmi3EnterEventMode), FMI3(fmi3Terminate), FMI3(fmi3Reset);
FMI3_Export NAME_Plain FMI3(fmi3EnterConfigurationMode), FMI3(fmi3ExitConfigurationMode), FMI3(fmi3EvaluateDiscreteStates);
FMI3_Export NAME_Plain FMI3(fmi3EnterContinuousTimeMode), FMI3(fmi3EnterStepMode);

VALUES(Float32)
VALUES(Float64)
VALUES(Int8)
VALUES(UInt8)
VALUES(Int16)
VALUES(UInt16)
VALUES(Int32)
VALUES(UInt32)
VALUES(Int64)
VALUES(UInt64)
VALUES(Boolean)
VALUES(String)
FMI3_Export fmi3Status FMI3(fmi3GetBinary)(fmi3Instance, const fmi3ValueReference[], size_t, size_t[], fmi3Binary[], size_t);
FMI3_Export fmi3Status FMI3(fmi3SetBinary)(fmi3Instance, const fmi3ValueReference[], size_t, const size_t[], const fmi3Binary[], size_t);
FMI3_Export fmi3Status FMI3(fmi3GetClock)(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Clock[]);
FMI3_Export fmi3Status FMI3(fmi3SetClock)(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Clock[]);

FMI3_Export fmi3Status FMI3(fmi3GetNumberOfVariableDependencies)(fmi3Instance, fmi3ValueReference, size_t *);
FMI3_Export fmi3Status FMI3(fmi3GetVariableDependencies)(fmi3Instance, fmi3ValueReference, size_t[], fmi3ValueReference[], size_t[],
                                                         fmi3DependencyKind[], size_t);

FMI3_Export NAME_Keep FMI3(fmi3GetFMUState), FMI3(fmi3FreeFMUState);
FMI3_Export fmi3Status FMI3(fmi3SetFMUState)(fmi3Instance, fmi3FMUState);
FMI3_Export fmi3Status FMI3(fmi3SerializedFMUStateSize)(fmi3Instance, fmi3FMUState, size_t *);
FMI3_Export fmi3Status FMI3(fmi3SerializeFMUState)(fmi3Instance, fmi3FMUState, fmi3Byte[], size_t);
FMI3_Export fmi3Status FMI3(fmi3DeserializeFMUState)(fmi3Instance, const fmi3Byte[], size_t, fmi3FMUState *);

FMI3_Export NAME_Derivative FMI3(fmi3GetDirectionalDerivative), FMI3(fmi3GetAdjointDerivative);

FMI3_Export fmi3Status FMI3(fmi3GetIntervalDecimal)(fmi3Instance, const fmi3ValueReference[], size_t, fmi3Float64[],
                                                    fmi3IntervalQualifier[]);
FMI3_Export fmi3Status FMI3(fmi3GetIntervalFraction)(fmi3Instance, const fmi3ValueReference[], size_t, fmi3UInt64[], fmi3UInt64[],
                                                     fmi3IntervalQualifier[]);
FMI3_Export NAME_Decimals FMI3(fmi3GetShiftDecimal);
FMI3_Export NAME_Fractions FMI3(fmi3GetShiftFraction);
FMI3_Export NAME_GivenDecimals FMI3(fmi3SetIntervalDecimal), FMI3(fmi3SetShiftDecimal);
FMI3_Export NAME_GivenFractions FMI3(fmi3SetIntervalFraction), FMI3(fmi3SetShiftFraction);
FMI3_Export fmi3Status FMI3(fmi3UpdateDiscreteStates)(fmi3Instance, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *,
                                                      fmi3Boolean *, fmi3Float64 *);

FMI3_Export fmi3Status FMI3(fmi3CompletedIntegratorStep)(fmi3Instance, fmi3Boolean, fmi3Boolean *, fmi3Boolean *);
FMI3_Export fmi3Status FMI3(fmi3SetTime)(fmi3Instance, fmi3Float64);
FMI3_Export fmi3Status FMI3(fmi3SetContinuousStates)(fmi3Instance, const fmi3Float64[], size_t);
FMI3_Export NAME_Numbers FMI3(fmi3GetContinuousStateDerivatives), FMI3(fmi3GetContinuousStates);
FMI3_Export NAME_Numbers FMI3(fmi3GetNominalsOfContinuousStates), FMI3(fmi3GetEventIndicators);
FMI3_Export NAME_Count FMI3(fmi3GetNumberOfEventIndicators), FMI3(fmi3GetNumberOfContinuousStates);

FMI3_Export fmi3Status FMI3(fmi3GetOutputDerivatives)(fmi3Instance, const fmi3ValueReference[], size_t, const fmi3Int32[], fmi3Float64[],
                                                      size_t);
FMI3_Export fmi3Status FMI3(fmi3DoStep)(fmi3Instance, fmi3Float64, fmi3Float64, fmi3Boolean, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *,
                                        fmi3Float64 *);
FMI3_Export fmi3Status FMI3(fmi3ActivateModelPartition)(fmi3Instance, fmi3ValueReference, fmi3Float64);
#undef VALUES

#endif

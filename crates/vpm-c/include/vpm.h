/* Compiled models of vpm (see docs/realtime.md). Written by `cargo test -p vpm-c`; do not edit. */

#ifndef VPM_H
#define VPM_H

#include <stddef.h>

/*
 How a call ended.
 */
typedef enum {
  /*
   It did what it says.
   */
  VPM_OK = 0,
  /*
   An argument is wrong, for example null, infinite or not a number; the simulation is as it was.
   */
  VPM_INVALID = 1,
  /*
   A state has left its bounds; all stays at the sample before, until `vpm_reset`.
   */
  VPM_DIVERGED = 2,
  /*
   A fault of the library itself; close the simulation and report the message.
   */
  VPM_FAULT = 3,
} VpmStatus;

/*
 A machine in simulated time. Made by `vpm_open`, released by `vpm_close`.
 */
typedef struct VpmSimulation VpmSimulation;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Name of an input, as `shoulder.command`; null beyond the last one. Valid until `vpm_close`.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
const char *vpm_input_name(const VpmSimulation *simulation, size_t number);

/*
 Name of an output, as `shoulder.position`; null beyond the last one. Valid until `vpm_close`.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
const char *vpm_output_name(const VpmSimulation *simulation, size_t number);

/*
 Name of a state, as `shoulder.velocity`; null beyond the last one. Valid until `vpm_close`.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
const char *vpm_state_name(const VpmSimulation *simulation, size_t number);

/*
 Name of a parameter, as `shoulder.friction.coulomb`; null beyond the last one. Valid until `vpm_close`.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
const char *vpm_parameter_name(const VpmSimulation *simulation, size_t number);

/*
 Opens a compiled model file.

 Returns a simulation at its start, to be released by `vpm_close`; null where the file cannot be used, with one sentence in `message`
 (`size` bytes; may be null).

 # Safety
 `path` is a zero-terminated text; `message` is null or has `size` bytes.
 */
VpmSimulation *vpm_open(const char *path,
                        char *message,
                        size_t size);

/*
 The same for the text of a compiled model that is in memory already.

 # Safety
 `model` is a zero-terminated text; `message` is null or has `size` bytes.
 */
VpmSimulation *vpm_open_text(const char *model, char *message, size_t size);

/*
 Releases a simulation; null is no harm.

 # Safety
 `simulation` is null or comes from `vpm_open`, and nobody uses it afterwards.
 */
void vpm_close(VpmSimulation *simulation);

/*
 Holds the inputs (`vpm_input_count` numbers) for the time of one sample and writes what the sensors show at its end into `outputs`
 (`vpm_output_count` numbers; may be null). Allocates nothing. Where it fails, `outputs` is left alone and `vpm_message` says why.

 # Safety
 `simulation` comes from `vpm_open`; the arrays have these lengths and do not overlap.
 */
VpmStatus vpm_step(VpmSimulation *simulation,
                   const double *inputs,
                   double *outputs);

/*
 Begins again at time zero in `state` (`vpm_state_count` numbers), or at the start of the file where it is null.

 # Safety
 `simulation` comes from `vpm_open`; `state` is null or has that length.
 */
VpmStatus vpm_reset(VpmSimulation *simulation, const double *state);

/*
 Gives the model other parameters (`vpm_parameter_count` numbers, in the order of `vpm_parameter_name`) and begins again at its start.
 Allocates; not for the loop.

 # Safety
 `simulation` comes from `vpm_open`; `parameters` has that length.
 */
VpmStatus vpm_set_parameters(VpmSimulation *simulation,
                             const double *parameters);

/*
 Writes the parameters of the model now (`vpm_parameter_count` numbers).

 # Safety
 `simulation` comes from `vpm_open`; `parameters` has that length.
 */
VpmStatus vpm_parameters(const VpmSimulation *simulation, double *parameters);

/*
 Writes the state now (`vpm_state_count` numbers).

 # Safety
 `simulation` comes from `vpm_open`; `state` has that length.
 */
VpmStatus vpm_state(const VpmSimulation *simulation, double *state);

/*
 Writes what the sensors show now (`vpm_output_count` numbers).

 # Safety
 `simulation` comes from `vpm_open`; `outputs` has that length.
 */
VpmStatus vpm_outputs(const VpmSimulation *simulation, double *outputs);

/*
 Time since the start, s; not a number where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
double vpm_time(const VpmSimulation *simulation);

/*
 Time between samples, s; not a number where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
double vpm_time_step(const VpmSimulation *simulation);

/*
 Numbers that a step takes; 0 where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
size_t vpm_input_count(const VpmSimulation *simulation);

/*
 Numbers that a step shows; 0 where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
size_t vpm_output_count(const VpmSimulation *simulation);

/*
 Numbers of the state; 0 where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
size_t vpm_state_count(const VpmSimulation *simulation);

/*
 Number of parameters; 0 where `simulation` is null.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
size_t vpm_parameter_count(const VpmSimulation *simulation);

/*
 One sentence about the last call that failed; valid until the next call that fails or `vpm_close`.

 # Safety
 `simulation` is null or comes from `vpm_open`.
 */
const char *vpm_message(const VpmSimulation *simulation);

/*
 Version of the library, as "0.1.0".
 */
const char *vpm_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* VPM_H */

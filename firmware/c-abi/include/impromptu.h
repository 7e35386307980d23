/**
 * Impromptu for C: a learned add-on that corrects the references of a control loop, and the quadrotor loop that is its first
 * user.
 *
 * C99 and C++. Made from firmware/c-abi/src by a test; do not edit.
 *
 *   desired trajectory (pushed ahead) --> adapter --> reference --> your loop
 *   measured state ------------------------^
 *
 * Memory   The caller owns all of it. An object is created in memory of its type, static or not, and needs no destruction: forget
 * it or
 *          create it anew. Memory that never held an object must be zeroed (as static memory is), so that use before creation is
 *          found. An object must not be moved or copied. A model file's bytes must outlive the model, the model what was created
 *          from it.
 * Threads  No globals, no locks, no clock, no allocation. Calls with different objects may run at the same time. Calls with the
 * same
 *          object must not, but for a model, which is only read after its creation. So a control interrupt may call the adapter
 *          while a task of lower priority is in impromptu_job_run. Job and inference are copied; hand them over as you hand over
 *          other data.
 * Time     Ticks are arguments. A reference tick is a period of the loop's references; call once for each, in order. After a
 *          gap the adapter starts its histories anew.
 * Units    SI and radians. World frame ENU (z up), body frame FLU, Hamilton quaternion body to world.
 * Errors   Every call that can fail returns an impromptu_status. NULL, misaligned pointers, objects that were not created and
 * counts
 *          that differ are found; pointers to too few values are not. Nothing unwinds or prints. On a microcontroller no part of
 *          the library can panic: else the linker would miss the symbol impromptu_can_panic.
 */

#ifndef IMPROMPTU_H
#define IMPROMPTU_H

#include <stddef.h>
#include <stdint.h>
#if UINTPTR_MAX > 0xffffffffu
#define IMPROMPTU_POINTER_64
#else
#define IMPROMPTU_POINTER_32
#endif

#if defined(IMPROMPTU_POINTER_64)
// Words of 8 bytes of an impromptu_model.
#define IMPROMPTU_MODEL_WORDS 704
#endif

#if defined(IMPROMPTU_POINTER_32)
// Words of 8 bytes of an impromptu_model.
#define IMPROMPTU_MODEL_WORDS 512
#endif

#if defined(IMPROMPTU_POINTER_64)
// Words of 8 bytes of an impromptu_adapter.
#define IMPROMPTU_ADAPTER_WORDS 2752
#endif

#if defined(IMPROMPTU_POINTER_32)
// Words of 8 bytes of an impromptu_adapter.
#define IMPROMPTU_ADAPTER_WORDS 2736
#endif

#if defined(IMPROMPTU_POINTER_64)
// Words of 8 bytes of an impromptu_flight.
#define IMPROMPTU_FLIGHT_WORDS 2096
#endif

#if defined(IMPROMPTU_POINTER_32)
// Words of 8 bytes of an impromptu_flight.
#define IMPROMPTU_FLIGHT_WORDS 2096
#endif

#if defined(IMPROMPTU_POINTER_64)
// Words of 8 bytes of an impromptu_learner.
#define IMPROMPTU_LEARNER_WORDS 480
#endif

#if defined(IMPROMPTU_POINTER_32)
// Words of 8 bytes of an impromptu_learner.
#define IMPROMPTU_LEARNER_WORDS 448
#endif

// Words of 8 bytes of an impromptu_scratch.
#define IMPROMPTU_SCRATCH_WORDS 257

// Most channels of a signal. A model with more of them, or with more corrected channels, is refused.
#define IMPROMPTU_MAX_CHANNELS 16

// Most network inputs.
#define IMPROMPTU_MAX_FEATURES 128

// Most corrected channels.
#define IMPROMPTU_MAX_OUTPUTS 8

// Reasons for which the guard trips a lane.
#define IMPROMPTU_TRIPS 8

// Most bytes of what a learner keeps.
#define IMPROMPTU_KEPT 848

// Samples of the desired trajectory that an adapter or a flight stack keeps, past ones included.
#define IMPROMPTU_PREVIEW 192

// What came of a call; impromptu_status_text says it in words. After anything but IMPROMPTU_STATUS_OK nothing was changed and
// no output was written, unless the function says otherwise.
enum impromptu_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  IMPROMPTU_STATUS_OK = 0,
  // A pointer is NULL.
  IMPROMPTU_STATUS_NULL = 1,
  // A pointer is not aligned for its type.
  IMPROMPTU_STATUS_MISALIGNED = 2,
  // The memory for an object is too small: header and library are of different versions.
  IMPROMPTU_STATUS_MEMORY = 3,
  // The object was not created, or is of another kind.
  IMPROMPTU_STATUS_NOT_CREATED = 4,
  // A count of channels differs from the signal table's, or exceeds IMPROMPTU_MAX_CHANNELS.
  IMPROMPTU_STATUS_COUNT = 5,
  // A number is NaN, infinite, or beyond what any vehicle has or does: 10 km, 400 m/s, 1000 m/s^2, 175 rad/s.
  IMPROMPTU_STATUS_NOT_FINITE = 6,
  // A name, unit or frame is not UTF-8.
  IMPROMPTU_STATUS_TEXT = 7,
  // The settings are impossible: a number that no vehicle has, or an airframe whose rotors cannot produce every moment.
  IMPROMPTU_STATUS_SETTINGS = 8,
  // The model has no network, or the flight stack no model.
  IMPROMPTU_STATUS_NOTHING = 9,
  // The model file is damaged or incomplete: copy it again.
  IMPROMPTU_STATUS_DAMAGED = 16,
  // Not a model file: give the file that model-export wrote.
  IMPROMPTU_STATUS_NOT_A_MODEL = 17,
  // Another format version: export the model with the matching model-export.
  IMPROMPTU_STATUS_VERSION = 18,
  // The model's card cannot be decoded: export it again.
  IMPROMPTU_STATUS_CARD = 19,
  // A count, shape or section is impossible or larger than this build allows: train a model that fits.
  IMPROMPTU_STATUS_SHAPE = 20,
  // A number in the model is not finite, out of range, or names what the model does not have: correct it and export again.
  IMPROMPTU_STATUS_VALUE = 21,
  // An integer layer could overflow: calibrate and export again.
  IMPROMPTU_STATUS_OVERFLOW = 22,
  // A probe gives other bits on this machine: do not fly, report it.
  IMPROMPTU_STATUS_PROBE = 23,
  // The stated bounds or limits exclude what the network gives: export the model again.
  IMPROMPTU_STATUS_BOUNDS = 24,
  // The signals of model and application differ in number, name, unit, frame or end rule.
  IMPROMPTU_STATUS_SIGNALS = 25,
  // The model looks further than IMPROMPTU_PREVIEW samples.
  IMPROMPTU_STATUS_PREVIEW = 26,
  // The model was trained for another rate of the references.
  IMPROMPTU_STATUS_RATE = 27,
  // The model is refused for a reason that this version of the library cannot name.
  IMPROMPTU_STATUS_REFUSED = 28,
  // The bounds of the correction say too little: a limit and a rate for each reference channel are needed.
  IMPROMPTU_STATUS_CAPS = 29,
  // A measured number is NaN or infinite: the tick was done with the last good sample.
  IMPROMPTU_STATUS_BAD_SAMPLE = 30,
  // There is no desired trajectory: the tick was done, the loop holds what was desired last or where it is.
  IMPROMPTU_STATUS_NO_TRAJECTORY = 31,
  // The preview is full: one more sample would push out what is still to be flown or looked back at. Push it after the next
  // reference ticks.
  IMPROMPTU_STATUS_FULL = 32,
  // The vehicle brakes, or rests where it has braked: only impromptu_flight_replan goes on.
  IMPROMPTU_STATUS_BRAKING = 33,
  // The reference tick has been flown, or lies further ahead than the preview keeps.
  IMPROMPTU_STATUS_TICK = 34,
  // The response of the axis is neither given nor measured: commission first, or give one.
  IMPROMPTU_STATUS_UNKNOWN = 35,
  // Nothing was kept there, or it is damaged, or the memory is too small to keep it: learn, then keep.
  IMPROMPTU_STATUS_NOT_KEPT = 36,
  // What was kept is of another loop, rate or identity: learn anew, then keep.
  IMPROMPTU_STATUS_OTHER = 37,
  // The axis is being commissioned: wait until it has ended, or stop it.
  IMPROMPTU_STATUS_BUSY = 38,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum impromptu_status impromptu_status;
#else
typedef int32_t impromptu_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why an axis was not commissioned.
enum impromptu_learner_problem
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nothing went wrong.
  IMPROMPTU_LEARNER_PROBLEM_NONE = 0,
  // The response is neither given nor measured.
  IMPROMPTU_LEARNER_PROBLEM_UNKNOWN = 1,
  // The loop did not move the machine.
  IMPROMPTU_LEARNER_PROBLEM_GROUNDED = 2,
  // The trajectory did not rest.
  IMPROMPTU_LEARNER_PROBLEM_MOVING = 3,
  // Ticks were left out.
  IMPROMPTU_LEARNER_PROBLEM_GAP = 4,
  // A fifth of the samples was missing.
  IMPROMPTU_LEARNER_PROBLEM_MISSING = 5,
  // There was other motion than that of the steps.
  IMPROMPTU_LEARNER_PROBLEM_NOISY = 6,
  // The loop does not follow its reference.
  IMPROMPTU_LEARNER_PROBLEM_GAIN = 7,
  // The loop moves against its reference.
  IMPROMPTU_LEARNER_PROBLEM_OPPOSITE = 8,
  // The loop is too slow or too fast.
  IMPROMPTU_LEARNER_PROBLEM_SPEED = 9,
  // For a reason that this version cannot name.
  IMPROMPTU_LEARNER_PROBLEM_OTHER = 10,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum impromptu_learner_problem impromptu_learner_problem;
#else
typedef uint32_t impromptu_learner_problem;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Memory for a model, in place: the model file itself stays where it is.
typedef struct impromptu_model {
  // Not for the caller.
  uint64_t words[IMPROMPTU_MODEL_WORDS];
} impromptu_model;

// What a model says of itself.
typedef struct impromptu_description {
  // CRC-32 that identifies the file.
  uint32_t checksum;
  // Desired, measured and reference channels.
  uint32_t channels[3];
  // Rate of the references, Hz.
  float reference_rate_hz;
  // Reference ticks in a tick of the network lane.
  uint32_t divisor;
  // Reference ticks of the past that must stay in the preview.
  uint32_t past;
  // Reference ticks of the future that should be pushed ahead.
  uint32_t future;
  // Corrected channels.
  uint32_t outputs;
  // 1 if there is a network lane.
  uint32_t network;
  // 1 if there is a feedback lane.
  uint32_t feedback;
} impromptu_description;

// Working memory for one evaluation of a network at a time.
typedef struct impromptu_scratch {
  // Not for the caller.
  uint64_t words[IMPROMPTU_SCRATCH_WORDS];
} impromptu_scratch;

// One evaluation of the network that is to be done.
typedef struct impromptu_job {
  // Reference tick at which it was released.
  int32_t tick;
  // The model's features, in physical units; zeros behind the last.
  float inputs[IMPROMPTU_MAX_FEATURES];
} impromptu_job;

// One evaluation of the network that was done.
typedef struct impromptu_inference {
  // Reference tick of its job.
  int32_t tick;
  // Correction of each output of the model.
  float outputs[IMPROMPTU_MAX_OUTPUTS];
} impromptu_inference;

// Memory for an adapter and the trajectory ahead of it.
typedef struct impromptu_adapter {
  // Not for the caller.
  uint64_t words[IMPROMPTU_ADAPTER_WORDS];
} impromptu_adapter;

// One channel of a signal. The texts must live until the adapter is created.
typedef struct impromptu_channel {
  // Name, for example "position.x"; of a reference channel, that of the desired channel from which it starts.
  const char *name;
  // SI unit, for example "m/s".
  const char *unit;
  // Frame, for example "world ENU".
  const char *frame;
  // Beyond the trajectory's ends: 0 the nearest sample is held (positions), 1 the channel is zero (velocities).
  uint32_t zero_beyond;
} impromptu_channel;

// The application's signals, compared with the model's.
typedef struct impromptu_signals {
  // Channels of the desired trajectory.
  const struct impromptu_channel *desired;
  // Number of desired channels.
  uint32_t desired_count;
  // Channels of the measured state.
  const struct impromptu_channel *measured;
  // Number of measured channels.
  uint32_t measured_count;
  // Channels of the reference.
  const struct impromptu_channel *reference;
  // Number of reference channels.
  uint32_t reference_count;
} impromptu_signals;

// What the correction of a reference channel may be, whatever a model says.
typedef struct impromptu_cap {
  // Largest absolute correction, in the channel's unit; 0: the channel is not corrected.
  float limit;
  // Largest rate of change of the correction, in the channel's unit a second.
  float rate;
} impromptu_cap;

// What an adapter has done.
typedef struct impromptu_report {
  // Correction of each output of the model in the last tick, in the channel's unit.
  float correction[IMPROMPTU_MAX_OUTPUTS];
  // How far the network lane is faded in, 0..1.
  float network_weight;
  // How far the feedback lane is faded in, 0..1.
  float feedback_weight;
  // Ticks in which a limit or the slew bounded the correction.
  uint32_t saturations;
  // Inferences that did not come in time.
  uint32_t late;
  // Reference tick of the next sample that is pushed.
  int32_t next_tick;
  // Ticks with a lane on in which the trajectory did not reach as far ahead as impromptu_description.future: what was missing
  // was taken as its end.
  uint32_t starved;
  // Samples of the trajectory ahead of the last reference tick; negative if it has ended.
  int32_t reach;
  // Trips of the network lane by reason: envelope, not finite, stale, saturated, counterfactual, late, oscillation, astray.
  uint16_t network_trips[IMPROMPTU_TRIPS];
  // Trips of the feedback lane by reason.
  uint16_t feedback_trips[IMPROMPTU_TRIPS];
} impromptu_report;

// Memory for a flight stack.
typedef struct impromptu_flight {
  // Not for the caller.
  uint64_t words[IMPROMPTU_FLIGHT_WORDS];
} impromptu_flight;

// Settings of the flight stack.
typedef struct impromptu_flight_settings {
  // Mass, kg.
  float mass;
  // Principal moments of inertia, kg m^2, body FLU.
  float inertia[3];
  // Positions of rotors 1..4 (forward, left), m.
  float rotors[4][2];
  // Sign of each rotor's reaction torque about the body's z axis.
  float directions[4];
  // Thrust over squared rotor speed, N s^2.
  float thrust_coefficient;
  // Reaction torque over squared rotor speed, N m s^2.
  float torque_coefficient;
  // Largest rotor speed, rad/s.
  float max_rotor_speed;
  // Position error to acceleration, world ENU, 1/s^2.
  float position_kp[3];
  // Velocity error to acceleration, 1/s.
  float position_kd[3];
  // Integrated position error to acceleration, 1/s^3.
  float position_ki[3];
  // Largest acceleration that the integral may ask for, m/s^2.
  float integral_limit;
  // Attitude error to angular acceleration, 1/s^2.
  float attitude_kp;
  // Body rate to angular acceleration, 1/s.
  float attitude_kd;
  // Control ticks (attitude loop) a second.
  float control_hz;
  // Control ticks in a tick of the position loop, which is the reference's tick.
  uint32_t position_divisor;
} impromptu_flight_settings;

// One sample of the desired trajectory.
typedef struct impromptu_setpoint {
  // Position, world ENU, m.
  float position[3];
  // Velocity, world ENU, m/s.
  float velocity[3];
  // Acceleration, world ENU, m/s^2.
  float acceleration[3];
  // Yaw, rad.
  float yaw;
} impromptu_setpoint;

// What the flight stack is told about the vehicle.
typedef struct impromptu_state {
  // Position, world ENU, m.
  float position[3];
  // Velocity, world ENU, m/s.
  float velocity[3];
  // Attitude: Hamilton quaternion w, x, y, z, body to world. Need not be normalised.
  float attitude[4];
  // Body rates, rad/s, body FLU.
  float rates[3];
  // Vertical acceleration in the world frame without gravity, m/s^2; a network input only, 0 if unknown.
  float vertical_acceleration;
} impromptu_state;

// What the position loop tracks: the desired state, corrected.
typedef struct impromptu_reference {
  // Position, world ENU, m.
  float position[3];
  // Velocity, world ENU, m/s.
  float velocity[3];
  // Yaw, rad.
  float yaw;
} impromptu_reference;

// What a control tick gives.
typedef struct impromptu_command {
  // Rotor speeds 1..4 as fractions of the largest speed: always finite, always in 0..1.
  float motors[4];
  // The reference that the position loop tracks.
  struct impromptu_reference reference;
} impromptu_command;

// Memory for what learns an axis, and the trajectory ahead of it.
typedef struct impromptu_learner {
  // Not for the caller.
  uint64_t words[IMPROMPTU_LEARNER_WORDS];
} impromptu_learner;

// Settings of what learns an axis. Values and their rates are in the unit of the axis, and a second.
typedef struct impromptu_learner_settings {
  // Rate of the references, Hz.
  float rate_hz;
  // Age of a measured value when it arrives, s.
  float age_s;
  // Number of the axis, so that several can be commissioned at once.
  uint32_t axis;
  // How the measured value answers a change of the reference, if it is known: gain at rest. 0: it is to be commissioned.
  float gain;
  // Natural frequency of the response, rad/s.
  float frequency;
  // Damping ratio of the response.
  float damping;
  // Delay of the response, s, the age of a measured value included.
  float delay_s;
  // About what a correction is at its largest in a calm motion: errors are judged by it.
  float scale;
  // Largest correction.
  float correction;
  // What of it may follow from the error.
  float feedback;
  // Largest change of the correction in a second.
  float rate;
  // By how much the reference steps to either side while the axis is commissioned; at most `correction`.
  float probe_size;
  // For how long, s: about three times the time in which the loop settles; at least 400 ticks.
  float probe_s;
  // What tells this loop from others, and the model before it, if there is one: what was kept of another is refused.
  uint32_t identity;
} impromptu_learner_settings;

// How far what learns an axis is.
typedef struct impromptu_progress {
  // 0 off, 1 commissioning, 2 learning, 3 holding.
  uint32_t phase;
  // An impromptu_learner_problem: what went wrong last in commissioning.
  uint32_t problem;
  // Share of commissioning that is done, 0..1.
  float commissioned;
  // Seconds in motion that were learned from.
  float learned_s;
  // Share of the correction that acts, 0..1.
  float share;
  // How often what was learned was forgotten because it did harm.
  uint32_t forgotten;
  // The correction of the last tick.
  float correction;
  // The response that it goes by: gain at rest, 0 if none is known.
  float gain;
  // Natural frequency, rad/s.
  float frequency;
  // How late a slow correction is answered, s.
  float lag_s;
  // Samples of the trajectory ahead of the last tick; negative if it has ended.
  int32_t reach;
} impromptu_progress;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// A status in words, with what to do; for any number.
const char *impromptu_status_text(int32_t status);

// Checks a model file of `length` bytes and creates the model in `model`, which has `size` bytes (sizeof *model). A model that
// was there before lives on if the file is refused; nothing that was created from it may be in use during the call.
//
// The bytes stay where they are, in flash for instance: they must live and keep unchanged as long as the model. They should
// start at a multiple of 16 bytes; elsewhere they are read by slower kernels, with the same results. Needs up to 4 KB of stack
// on a microcontroller; what is not said to need more, 2 KB.
impromptu_status impromptu_model_create(struct impromptu_model *model, size_t size, const uint8_t *bytes, size_t length);

// What a model says of itself.
impromptu_status impromptu_model_describe(const struct impromptu_model *model, struct impromptu_description *description);

// Creates the working memory of an evaluation in `scratch`, which has `size` bytes. One is enough for everything that never runs
// at the same time.
impromptu_status impromptu_scratch_create(struct impromptu_scratch *scratch, size_t size);

// Evaluates the network: the work of a task of lower priority. It touches nothing but its arguments, so that an adapter or
// flight stack may go on at the same time.
impromptu_status impromptu_job_run(const struct impromptu_job *job,
                                   const struct impromptu_model *model,
                                   struct impromptu_scratch *scratch,
                                   struct impromptu_inference *inference);

// Bytes of an object as the library was compiled: at most the sizeof of its type in the header. For checks in tests and start-up
// code.
size_t impromptu_model_size(void);

// Creates an adapter in `adapter`, which has `size` bytes, for a loop whose references run at `rate_hz`. Both lanes are off.
//
// `signals` is compared with the model's table, name by name; NULL takes the model's for the application's. `caps` says for each
// reference channel, `cap_count` of them in the order of the signals, what its correction may be, whatever the model says: there
// is no default. The model must live as long as the adapter. The first sample pushed will be that of reference tick
// `first_tick`. Needs up to 4 KB of stack.
impromptu_status impromptu_adapter_create(struct impromptu_adapter *adapter,
                                          size_t size,
                                          const struct impromptu_model *model,
                                          const struct impromptu_signals *signals,
                                          float rate_hz,
                                          int32_t first_tick,
                                          const struct impromptu_cap *caps,
                                          size_t cap_count);

// impromptu_adapter_create for the signals of a quadrotor, as the flight stack has them: 10 desired channels (position,
// velocity, acceleration, yaw), 13 measured (position, velocity, roll, pitch, yaw, body rates, vertical acceleration without
// gravity), 6 references (position, velocity). m, s, rad; world ENU, body FLU, pitch positive nose down. A correction of a
// position is at most 1 m and 40 m/s, one of a velocity at most 4 m/s and 160 m/s^2.
impromptu_status impromptu_adapter_create_quadrotor(struct impromptu_adapter *adapter,
                                                    size_t size,
                                                    const struct impromptu_model *model,
                                                    float rate_hz,
                                                    int32_t first_tick);

// Appends the desired channels of the next reference tick. Push as far ahead as impromptu_description.future says; what is
// missing is taken as the trajectory's end.
impromptu_status impromptu_adapter_push(struct impromptu_adapter *adapter, const float *desired, size_t count);

// Forgets the trajectory, for another one: the next sample pushed will be that of reference tick `first_tick`. Until then the
// loop holds what was desired last. For another trajectory on the way without a gap: impromptu_adapter_replan.
impromptu_status impromptu_adapter_restart(struct impromptu_adapter *adapter, int32_t first_tick);

// Forgets the samples of reference tick `from` and later, in whose place others will be pushed: the next one is that of
// impromptu_report.next_tick, which is `from` unless fewer had been pushed. What lies before stays.
impromptu_status impromptu_adapter_replan(struct impromptu_adapter *adapter, int32_t from);

// Lets lanes act again that the guard has handed over for good. What is still wrong hands them over again.
impromptu_status impromptu_adapter_rearm(struct impromptu_adapter *adapter);

// Tells how many reference ticks ago the newest measurement arrived, beyond the delay that the model knows; 0 from the start.
// Both lanes are handed over while it is older than 0.1 s.
impromptu_status impromptu_adapter_set_age(struct impromptu_adapter *adapter, uint32_t ticks);

// States that measured channels have noise in them, bit `c` of `channels` for channel `c`, so that all of them together are
// never twice the same but where no new measurement came, for at most `ticks` reference ticks in a row. Once they have been the
// same for longer, they are as old as that: both lanes are handed over from 0.1 s on. No bit, as from the start: nothing is
// stated.
impromptu_status impromptu_adapter_expect_noise(struct impromptu_adapter *adapter, uint32_t channels, uint32_t ticks);

// States whether the loop moves the machine (not 0): a vehicle on the ground, or a machine that is held, does not follow. Until
// it does, no lane acts, nothing is integrated, learned or judged; then the lanes fade in. It does from the start on.
impromptu_status impromptu_adapter_set_airborne(struct impromptu_adapter *adapter, int airborne);

// Writes what the feedback lane corrected of each reference channel in the last tick, as many numbers as the loop has reference
// channels, for what learns beside it (impromptu_learner_tell_other).
impromptu_status impromptu_adapter_fed_back(struct impromptu_adapter *adapter, float *fed_back, size_t count);

// Switches the network lane and the feedback lane on (not 0) or off; they fade in and out over the model's fade time. With both
// off and faded out the reference is the desired one, to the bit.
impromptu_status impromptu_adapter_switch(struct impromptu_adapter *adapter, int network, int feedback);

// Gives inferences time until the next reference tick: for a network that is evaluated by a task of lower priority. Once, after
// impromptu_adapter_create.
impromptu_status impromptu_adapter_defer(struct impromptu_adapter *adapter);

// A whole reference tick, the network included: takes what is measured and writes the reference that the loop shall track.
//
// It is written, and the tick is done, also after IMPROMPTU_STATUS_BAD_SAMPLE (a measured number is NaN or infinite: it counts
// as a missed sample, the last good one stands in) and IMPROMPTU_STATUS_NO_TRAJECTORY (nothing was pushed since creation or
// impromptu_adapter_restart: the loop holds what was desired last or, at first, where it is).
impromptu_status impromptu_adapter_step(struct impromptu_adapter *adapter,
                                        struct impromptu_scratch *scratch,
                                        int32_t tick,
                                        const float *measured,
                                        size_t measured_count,
                                        float *reference,
                                        size_t reference_count);

// First part of a reference tick. Sets `due` to 1 and writes `job` if the network is to be evaluated (impromptu_job_run), else
// sets it to 0 and leaves `job` alone. The inference is given to impromptu_adapter_deliver by whoever calls the adapter, before
// impromptu_adapter_finish or, after impromptu_adapter_defer, before the next impromptu_adapter_begin.
impromptu_status impromptu_adapter_begin(struct impromptu_adapter *adapter,
                                         int32_t tick,
                                         const float *measured,
                                         size_t measured_count,
                                         struct impromptu_job *job,
                                         int *due);

// Takes what came of the last job; one that is not awaited any more is dropped. One with a number that is not finite is refused,
// and late.
impromptu_status impromptu_adapter_deliver(struct impromptu_adapter *adapter, const struct impromptu_inference *inference);

// Second part of a reference tick: writes the reference that the loop shall track. The statuses are those of
// impromptu_adapter_step.
impromptu_status impromptu_adapter_finish(struct impromptu_adapter *adapter,
                                          int32_t tick,
                                          const float *measured,
                                          size_t measured_count,
                                          float *reference,
                                          size_t reference_count);

// Correction, fades, saturations, late inferences, trips and how far the trajectory reaches.
impromptu_status impromptu_adapter_report(struct impromptu_adapter *adapter, struct impromptu_report *result);

// Bytes of an adapter as the library was compiled: at most sizeof(impromptu_adapter).
size_t impromptu_adapter_size(void);

// Creates a flight stack in `flight`, which has `size` bytes, with no add-on. The first setpoint is that of reference tick 0.
impromptu_status impromptu_flight_create(struct impromptu_flight *flight,
                                         size_t size,
                                         const struct impromptu_flight_settings *settings);

// Puts an add-on before the loop, with the lanes that are not 0 on. The model must live as long as the flight stack.
// Needs up to 4 KB of stack.
impromptu_status impromptu_flight_attach(struct impromptu_flight *flight,
                                         const struct impromptu_model *model,
                                         int network,
                                         int feedback);

// Appends the desired state of the next reference tick, as far ahead as impromptu_description.future says. One that is not
// finite, or that no vehicle can be asked for, gives IMPROMPTU_STATUS_NOT_FINITE and is not stored: the next one is still that
// of the same tick. After impromptu_flight_brake it gives IMPROMPTU_STATUS_BRAKING; with so many ahead that the next one would
// push out what is still to be flown, or looked back at, IMPROMPTU_STATUS_FULL.
impromptu_status impromptu_flight_push(struct impromptu_flight *flight, const struct impromptu_setpoint *setpoint);

// Replaces what is stored from reference tick `tick` on, which must not have been flown: `setpoint` is the new trajectory's
// first, and further ones are pushed. What it differs by from the old one fades within 5 m/s and 3 m/s^2, so that nothing
// jumps. It ends a brake.
impromptu_status impromptu_flight_replan(struct impromptu_flight *flight,
                                         int32_t tick,
                                         const struct impromptu_setpoint *setpoint);

// Replaces what is stored after the present by coming to rest within 3 m/s^2 and 8 m/s^3, and resting there until
// impromptu_flight_replan.
impromptu_status impromptu_flight_brake(struct impromptu_flight *flight);

// Lets lanes act again that the guard has handed over for good. What is still wrong hands them over again.
impromptu_status impromptu_flight_rearm(struct impromptu_flight *flight);

// States whether the vehicle is in the air (not 0), which a loop that is closed on the ground cannot know: until it is, no lane
// acts, and nothing is integrated or learned. It is from the start on.
impromptu_status impromptu_flight_set_airborne(struct impromptu_flight *flight, int airborne);

// Switches the network lane and the feedback lane on (not 0) or off.
impromptu_status impromptu_flight_switch(struct impromptu_flight *flight, int network, int feedback);

// One control tick, the network included. Ticks count from 0. A state that is not finite, or that no vehicle can be in, gives
// IMPROMPTU_STATUS_NOT_FINITE, no command, and changes nothing: a missed sample. What the motors then do is the caller's
// decision. Needs up to 4 KB of stack.
impromptu_status impromptu_flight_step(struct impromptu_flight *flight,
                                       struct impromptu_scratch *scratch,
                                       uint32_t tick,
                                       const struct impromptu_state *state,
                                       struct impromptu_command *command);

// One control tick without the network: the same commands as impromptu_flight_step, if each inference is delivered before the
// next reference tick. Sets `due` to 1 and writes `job` if the network is to be evaluated (impromptu_job_run), else sets it to
// 0. Needs up to 4 KB of stack.
impromptu_status impromptu_flight_control(struct impromptu_flight *flight,
                                          uint32_t tick,
                                          const struct impromptu_state *state,
                                          struct impromptu_command *command,
                                          struct impromptu_job *job,
                                          int *due);

// Takes what came of the last job; one that is not awaited any more is dropped.
impromptu_status impromptu_flight_deliver(struct impromptu_flight *flight, const struct impromptu_inference *inference);

// What the add-on has done; IMPROMPTU_STATUS_NOTHING without one.
impromptu_status impromptu_flight_report(struct impromptu_flight *flight, struct impromptu_report *result);

// Bytes of a flight stack as the library was compiled: at most sizeof(impromptu_flight).
size_t impromptu_flight_size(void);

// Creates in `learner`, which has `size` bytes, what learns the corrections of one axis while its loop runs: no model is needed.
// It is off: impromptu_learner_commission or impromptu_learner_learn start it. An axis more is an object more. The first sample
// pushed will be that of reference tick `first_tick`. Needs up to 8 KB of stack.
impromptu_status impromptu_learner_create(struct impromptu_learner *learner,
                                          size_t size,
                                          const struct impromptu_learner_settings *settings,
                                          int32_t first_tick);

// Appends what is desired at the next reference tick. Push 80 ticks ahead; what is missing is taken as the trajectory's end. At
// most 128 samples are kept.
impromptu_status impromptu_learner_push(struct impromptu_learner *learner, float desired);

// Forgets the trajectory, for another one: the next sample pushed will be that of reference tick `first_tick`. What was learned
// stays.
impromptu_status impromptu_learner_restart(struct impromptu_learner *learner, int32_t first_tick);

// Forgets what is desired at reference tick `from` and later, for another trajectory from there on: the next sample pushed is
// that of `from`, if as many had been pushed. What lies before stays.
impromptu_status impromptu_learner_replan(struct impromptu_learner *learner, int32_t from);

// States what a correction may be from the next step on, within the limits: for a loop of which it is known how far the desired
// motion may need one. The limits if it is not said; what is not a number is refused.
impromptu_status impromptu_learner_bound(struct impromptu_learner *learner, float low, float high);

// States, before a step, what another feedback corrected of this axis in the last tick, as a model's feedback lane
// (impromptu_adapter_fed_back): what that resists is not still missing. Measure the response without it.
impromptu_status impromptu_learner_tell_other(struct impromptu_learner *learner, float correction);

// Measures the response: as soon as the trajectory rests, the reference steps to and fro by the stated size; then it learns,
// from nothing. impromptu_learner_report tells how far it is, and why it was given up.
impromptu_status impromptu_learner_commission(struct impromptu_learner *learner);

// Learns and corrects. IMPROMPTU_STATUS_UNKNOWN: no response is known.
impromptu_status impromptu_learner_learn(struct impromptu_learner *learner);

// Corrects by what it has learned, and learns no more. IMPROMPTU_STATUS_UNKNOWN: no response is known.
impromptu_status impromptu_learner_hold(struct impromptu_learner *learner);

// Neither learns nor corrects: the correction goes back to nothing by its rate. What was learned stays.
impromptu_status impromptu_learner_stop(struct impromptu_learner *learner);

// Forgets what was learned, not how the loop answers.
impromptu_status impromptu_learner_forget(struct impromptu_learner *learner);

// A reference tick: writes the correction, which the caller adds to what is desired. `measured` is the value of the axis, `rate`
// its rate of change; NaN stands for a sample that is missing and for a rate that is not measured. `moving` (not 0) says that
// the loop moves the machine: else nothing is learned and nothing corrected.
//
// It is written, and the tick is done, also after IMPROMPTU_STATUS_BAD_SAMPLE (the value was missing) and
// IMPROMPTU_STATUS_NO_TRAJECTORY (nothing was pushed: no correction).
//
// Needs up to 8 KB of stack where commissioning begins and ends, else 2 KB.
impromptu_status impromptu_learner_step(struct impromptu_learner *learner,
                                        int32_t tick,
                                        float measured,
                                        float rate,
                                        int moving,
                                        float *correction);

// How far it is.
impromptu_status impromptu_learner_report(const struct impromptu_learner *learner, struct impromptu_progress *result);

// Writes what was learned to `bytes`, which has room for `size` of them, and their number to `length`: to be stored, and given
// to impromptu_learner_recall after a power cut. IMPROMPTU_KEPT bytes are enough. Needs up to 4 KB of stack.
impromptu_status impromptu_learner_keep(const struct impromptu_learner *learner, uint8_t *bytes, size_t size, size_t *length);

// Goes on with what was kept, `size` bytes or more at `bytes`: in the phase in which it is. IMPROMPTU_STATUS_OTHER: it is of
// another loop. Needs up to 8 KB of stack.
impromptu_status impromptu_learner_recall(struct impromptu_learner *learner, const uint8_t *bytes, size_t size);

// Bytes of a learner as the library was compiled: at most sizeof(impromptu_learner).
size_t impromptu_learner_size(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* IMPROMPTU_H */

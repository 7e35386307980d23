/*
 * Out-of-tree controller for the Crazyflie's firmware: the stock PID or Mellinger controller, with corrected references.
 *
 * Whatever the commander wants is passed on. Where it follows a plan of its own (go-to, spirals, uploaded trajectories, hover),
 * a correction is added to the position that it asks for; velocity, acceleration, jerk and rates stay as they are, but for what
 * a model corrects of the velocity. All else (take-off, landing, streamed set-points, a stop, what the supervisor puts in their
 * place) is flown bare. No motor is ever stopped here.
 *
 * The stabilizer task copies a sample and adds a correction; the rest is done by the app task (work.c).
 *
 * Everything that differs between the Crazyflie and Impromptu is converted in `measure`, nowhere else.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "FreeRTOS.h"
#include "task.h"

#include "app.h"
#include "config.h"
#include "controller.h"
#include "controller_mellinger.h"
#include "controller_pid.h"
#include "log.h"
#include "param.h"
#include "stabilizer_types.h"
#include "usec_time.h"

#include "impromptu.h"
#include "plan.h"
#include "work.h"

/* By how much a correction that is not wanted any more goes in a tick: 2 m/s, and 10 m/s^2. */
#define FADE_POSITION 0.02f
#define FADE_VELOCITY 0.1f
/* A correction that does not come for so many ticks is not wanted any more. */
#define LATE 5
/* Beyond this distance from where the plan is, m, and below this height, nothing is corrected. */
#define FAR 1.5f
#define FLOOR 0.0f

/* What is added to the stabilizer task's stack is less than this, and the frames below are all there is of it (a test measures
 * it); the task has room for it beside the largest of the stock controllers. */
#define STACK 600
_Static_assert(STABILIZER_TASK_STACKSIZE * sizeof(StackType_t) >= 1100 + STACK, "give the stabilizer task more stack (config.h)");
_Static_assert(POSITION_RATE == 100, "the references of a Crazyflie have 100 Hz");

/* Parameters: the controller that is corrected; what corrects it: 1 what is learned, 2 a model's network, 4 its feedback lane. */
static uint8_t inner = INNER_PID;
static uint8_t lanes = 7;
static uint8_t forget;
/* Of a dither on the position, m: for logs that a model is trained with. */
static float dither;
static int32_t problem;

/* The hand-over. Each flag is set by one side and cleared by the other; only the side whose turn it is touches the data. One
 * core: the order of the program is enough. */
static struct sample sample;
static struct correction newest;
static volatile bool sample_waits, correction_waits;
#define IN_ORDER() __asm__ volatile("" ::: "memory")

static int32_t tick;
static uint8_t active;         /* inner controller */
static bool rested = true;     /* since then the commander has had the motors off */
static bool corrects;          /* the commander follows a plan that is corrected */
static bool replans;           /* another plan than the last sample's */
static float wanted[REFERENCE], added[REFERENCE];
static int32_t wanted_at;
static uint32_t late;
static point_t desired, flown; /* for the logs */

/* Crazyflie: attitude in degrees with an inverted pitch (positive nose up), rates in degrees/s about right-handed axes, acceleration in g
 * without gravity. Impromptu: rad, positive nose down, rad/s, m/s^2. Position and velocity are the same. */
static void measure(const sensorData_t *sensors, const state_t *state, float measured[MEASURED])
{
  const float rad = 3.14159265f / 180.0f;

  measured[0] = state->position.x;
  measured[1] = state->position.y;
  measured[2] = state->position.z;
  measured[3] = state->velocity.x;
  measured[4] = state->velocity.y;
  measured[5] = state->velocity.z;
  measured[6] = state->attitude.roll * rad;
  measured[7] = -state->attitude.pitch * rad;
  measured[8] = state->attitude.yaw * rad;
  measured[9] = sensors->gyro.x * rad;
  measured[10] = sensors->gyro.y * rad;
  measured[11] = sensors->gyro.z * rad;
  measured[12] = state->acc.z * 9.81f;
}

static bool is_position(const setpoint_t *setpoint)
{
  return setpoint->mode.x == modeAbs && setpoint->mode.y == modeAbs && setpoint->mode.z == modeAbs;
}

/* Whether a plan of the commander is to be corrected: not what is streamed, nor a landing, nor what begins on the ground. */
static bool is_to_correct(const setpoint_t *setpoint, const state_t *state, const struct planner *planner, float now)
{
  static float begun;
  const bool flies = planner && planner->state == TRAJECTORY_STATE_FLYING;

  if (!planner && is_position(setpoint)) {
    problem = PROBLEM_NO_PLANNER;
  }
  if (!flies || !is_position(setpoint)) {
    rested = rested || (planner && planner->state == TRAJECTORY_STATE_IDLE);
    begun = NAN;
    return false;
  }
  const bool compressed = planner->type == TRAJECTORY_TYPE_PIECEWISE_COMPRESSED;
  const float began = compressed ? planner->compressed_trajectory->t_begin : planner->trajectory->t_begin;
  if (rested) {
    /* The plan that leaves the ground is flown bare, to its end or until another one follows it. */
    begun = isnan(begun) ? began : begun;
    const bool over = !compressed && planner->trajectory == &planner->planned_trajectory &&
                      now - began > planner->pieces[0].duration * planner->planned_trajectory.timescale;
    rested = began == begun && !over;
    return false;
  }
  if (setpoint->position.z < FLOOR) {
    problem = PROBLEM_FLOOR;
    return false;
  }
  const float away = fmaxf(fmaxf(fabsf(setpoint->position.x - state->position.x), fabsf(setpoint->position.y - state->position.y)),
                           fabsf(setpoint->position.z - state->position.z));
  if (!(away <= FAR)) {
    problem = PROBLEM_FAR;
    return false;
  }
  return true;
}

/* A tick of the references: takes the correction of this tick, and gives a sample for that of the next one. */
static void exchange(const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state)
{
  const struct planner *planner = plan_seen;
  /* The commander's clock. */
  const float now = usecTimestamp() / 1e6;

  tick++;
  corrects = is_to_correct(setpoint, state, planner, now);
  if (correction_waits) {
    IN_ORDER();
    memcpy(wanted, newest.of, sizeof wanted);
    wanted_at = newest.tick;
    IN_ORDER();
    correction_waits = false;
  }
  if (sample_waits) {
    late++;
    return;
  }
  /* A plan is compared with that of the sample, which is the last one that was worked on. */
  replans = corrects && !plan_is(planner, &sample.plan);
  if (replans) {
    plan_copy(planner, &sample.plan);
  }
  sample.tick = tick;
  sample.time = now;
  sample.inner = active;
  sample.lanes = lanes;
  sample.flies = corrects;
  sample.replanned = replans;
  sample.forget = forget;
  forget = 0;
  measure(sensors, state, sample.measured);
  IN_ORDER();
  sample_waits = true;
}

/* Goes to the correction that is wanted; where none is, it goes away by a ramp. */
static void add(void)
{
  const bool holds = corrects && tick - wanted_at <= LATE;

  for (int i = 0; i < REFERENCE; i++) {
    const float most = i < 3 ? FADE_POSITION : FADE_VELOCITY;
    const float step = (holds ? wanted[i] : 0.0f) - added[i];
    /* What is learned has limits of its own for how fast it goes. */
    added[i] += holds && isfinite(step) ? step : fmaxf(-most, fminf(most, isfinite(step) ? step : 0.0f));
  }
}

static bool is_bare(void)
{
  for (int i = 0; i < REFERENCE; i++) {
    if (added[i] != 0.0f) {
      return false;
    }
  }
  return true;
}

void controllerOutOfTreeInit(void)
{
  controllerPidInit();
  controllerMellingerFirmwareInit();
}

bool controllerOutOfTreeTest(void)
{
  return controllerPidTest() && controllerMellingerFirmwareTest();
}

/* The commander's set-point with what is added: else not a bit of it, not even by an addition of zero. */
static void correct(setpoint_t *corrected)
{
  float *const places[REFERENCE] = {&corrected->position.x, &corrected->position.y, &corrected->position.z,
                                    &corrected->velocity.x, &corrected->velocity.y, &corrected->velocity.z};

  for (int i = 0; i < REFERENCE; i++) {
    if (added[i] != 0.0f) {
      *places[i] += added[i];
    }
  }
}

/* Two signs of 0.16 s and of 0.44 s a step, so that both axes and the height are told apart. */
static void shake(setpoint_t *corrected)
{
  const int32_t steps = tick / 16, longer = tick / 44;

  corrected->position.x += (steps * 7 + steps / 5) & 1 ? dither : -dither;
  corrected->position.y += (longer + steps / 3) & 1 ? dither : -dither;
  corrected->position.z += (longer * 3 + steps / 7) & 1 ? dither : -dither;
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t stabilizerStep)
{
  static setpoint_t corrected;
  const setpoint_t *given = setpoint;

  if (RATE_DO_EXECUTE(POSITION_RATE, stabilizerStep)) {
    exchange(setpoint, sensors, state);
    add();
    if (work_problem != 0) {
      problem = work_problem;
    }
  }
  if (!is_position(setpoint)) {
    memset(added, 0, sizeof added);
  } else if (!is_bare() || (corrects && dither != 0.0f)) {
    corrected = *setpoint;
    correct(&corrected);
    if (corrects && dither != 0.0f) {
      shake(&corrected);
    }
    given = &corrected;
  }
  desired = setpoint->position;
  flown = given->position;
  /* Another controller takes over on the ground alone. */
  const bool off = setpoint->mode.z == modeDisable && setpoint->thrust == 0.0f;
  if (active == 0 || (off && active != inner)) {
    active = inner == INNER_MELLINGER ? INNER_MELLINGER : INNER_PID;
  }
  if (active == INNER_MELLINGER) {
    controllerMellingerFirmware(control, given, sensors, state, stabilizerStep);
  } else {
    controllerPid(control, given, sensors, state, stabilizerStep);
  }
}

/* What the app task does in a millisecond. */
static void work(void)
{
  static struct sample own;
  static struct correction correction;

  if (sample_waits) {
    IN_ORDER();
    own = sample;
    IN_ORDER();
    sample_waits = false;
    work_do(&own, &correction);
    if (!correction_waits) {
      IN_ORDER();
      newest = correction;
      IN_ORDER();
      correction_waits = true;
    }
  }
}

void appMain(void)
{
  const bool started = work_start();

  while (1) {
    if (started) {
      work();
    }
    vTaskDelay(M2T(1));
  }
}

PARAM_GROUP_START(impromptu)
PARAM_ADD(PARAM_UINT8, inner, &inner)
PARAM_ADD(PARAM_UINT8, lanes, &lanes)
PARAM_ADD(PARAM_UINT8, forget, &forget)
PARAM_ADD(PARAM_FLOAT, dither, &dither)
PARAM_ADD(PARAM_INT32 | PARAM_RONLY, problem, &problem)
PARAM_GROUP_STOP(impromptu)

LOG_GROUP_START(impromptu)
LOG_ADD(LOG_FLOAT, desired_x, &desired.x)
LOG_ADD(LOG_FLOAT, desired_y, &desired.y)
LOG_ADD(LOG_FLOAT, desired_z, &desired.z)
LOG_ADD(LOG_FLOAT, reference_x, &flown.x)
LOG_ADD(LOG_FLOAT, reference_y, &flown.y)
LOG_ADD(LOG_FLOAT, reference_z, &flown.z)
LOG_ADD(LOG_FLOAT, learned_s, &work_learned)
LOG_ADD(LOG_FLOAT, share, &work_share)
LOG_ADD(LOG_UINT32, late, &late)
LOG_GROUP_STOP(impromptu)

/*
 * Out-of-tree controller for the Crazyflie's firmware: flies a trajectory that was uploaded, with references corrected by
 * Impromptu, through the stock Mellinger controller.
 *
 * The trajectory is what every ground station uploads for the high-level commander: pieces of polynomials in the trajectory
 * memory. The commander gives setpoints of the present only, but the add-on looks ahead; so this controller evaluates the pieces
 * itself, as far ahead as the model asks. Take off and hover with the high-level commander, then set the parameter
 * impromptu.pieces to the number of pieces. Zero gives the setpoints back to the commander, whose setpoints pass through here
 * untouched.
 *
 * Everything that differs between the Crazyflie and Impromptu is converted in `measure` and `evaluate`, nowhere else.
 */
#include <stdbool.h>
#include <stdint.h>

#include "FreeRTOS.h"
#include "task.h"

#include "app.h"
#include "controller.h"
#include "controller_mellinger.h"
#include "crtp_commander_high_level.h"
#include "param.h"
#include "pptraj.h"
#include "stabilizer_types.h"

#include "impromptu.h"

#define DESIRED 10
#define MEASURED 13
#define REFERENCE 6
#define MAX_PIECES 31

/* The model file, linked in: see the Kbuild file. */
extern const uint8_t impromptu_model_start[];
extern const uint8_t impromptu_model_end[];

static impromptu_model model;
static impromptu_adapter adapter;
static impromptu_scratch scratch;
static impromptu_description about;
static struct poly4d pieces[MAX_PIECES];

/* Parameters: pieces to fly (0: none), lanes (1 network, 2 feedback), and what came of it (an impromptu_status). */
static volatile uint8_t wanted;
static uint8_t lanes = 3;
static int32_t problem;

/* Who has the adapter: nobody, the app task that prepares a flight, or the stabilizer task that flies it. */
static volatile enum { IDLE, PREPARING, FLYING } stage;
static uint8_t flown;    /* pieces of the trajectory */
static int32_t tick;     /* reference ticks since its start */
static float reference[REFERENCE];
static float yaw;

/* Hand-over between the stabilizer task, which may not wait for the network, and the app task, which evaluates it. Each flag is set by one
 * side and cleared by the other; only the side whose turn it is touches the data. One core: the order of the program is enough.
 * */
static impromptu_job job;
static impromptu_inference inference;
static volatile bool job_waits, inference_waits;
#define IN_ORDER() __asm__ volatile("" ::: "memory")

static bool failed(impromptu_status status)
{
  if (status != IMPROMPTU_STATUS_OK) {
    problem = status;
  }
  return status != IMPROMPTU_STATUS_OK;
}

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

/* The desired channels at a time since the trajectory's start; beyond its end it stands still. */
static void evaluate(float time, float desired[DESIRED])
{
  uint8_t piece = 0;
  bool beyond = false;

  while (time > pieces[piece].duration) {
    if (piece + 1 == flown) {
      time = pieces[piece].duration;
      beyond = true;
      break;
    }
    time -= pieces[piece].duration;
    piece++;
  }
  const struct traj_eval now = poly4d_eval(&pieces[piece], time);
  const float moves = beyond ? 0.0f : 1.0f;
  desired[0] = now.pos.x;
  desired[1] = now.pos.y;
  desired[2] = now.pos.z;
  desired[3] = now.vel.x * moves;
  desired[4] = now.vel.y * moves;
  desired[5] = now.vel.z * moves;
  desired[6] = now.acc.x * moves;
  desired[7] = now.acc.y * moves;
  desired[8] = now.acc.z * moves;
  desired[9] = now.yaw;
}

static bool push(int32_t at)
{
  float desired[DESIRED];

  evaluate((float)at / POSITION_RATE, desired);
  return !failed(impromptu_adapter_push(&adapter, desired, DESIRED));
}

/* One reference tick. */
static void correct(const sensorData_t *sensors, const state_t *state)
{
  static impromptu_job newest;
  float measured[MEASURED], desired[DESIRED];
  int due = 0;

  measure(sensors, state, measured);
  push(tick + (int32_t)about.future + 1);
  failed(impromptu_adapter_switch(&adapter, lanes & 1, lanes & 2));
  if (inference_waits) {
    IN_ORDER();
    failed(impromptu_adapter_deliver(&adapter, &inference));
    IN_ORDER();
    inference_waits = false;
  }
  failed(impromptu_adapter_begin(&adapter, tick, measured, MEASURED, &newest, &due));
  /* A job that the app task has not finished is not replaced: its inference is late, which the adapter counts and fades over. */
  if (due && !job_waits) {
    job = newest;
    IN_ORDER();
    job_waits = true;
  }
  failed(impromptu_adapter_finish(&adapter, tick, measured, MEASURED, reference, REFERENCE));
  evaluate((float)tick / POSITION_RATE, desired);
  yaw = desired[9];
  tick++;
}

void controllerOutOfTreeInit(void)
{
  controllerMellingerFirmwareInit();
}

bool controllerOutOfTreeTest(void)
{
  return controllerMellingerFirmwareTest();
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                         const stabilizerStep_t stabilizerStep)
{
  setpoint_t corrected = *setpoint;

  if (RATE_DO_EXECUTE(POSITION_RATE, stabilizerStep)) {
    if (stage == IDLE && wanted != 0) {
      stage = PREPARING;
    } else if (stage == FLYING && wanted != flown) {
      stage = IDLE;
    } else if (stage == FLYING) {
      correct(sensors, state);
    }
  }
  /* A commander that wants the motors off, or attitudes, is obeyed. */
  const bool position = setpoint->mode.x == modeAbs && setpoint->mode.y == modeAbs && setpoint->mode.z == modeAbs;
  if (stage == FLYING && tick > 0 && position) {
    corrected.position.x = reference[0];
    corrected.position.y = reference[1];
    corrected.position.z = reference[2];
    corrected.velocity.x = reference[3];
    corrected.velocity.y = reference[4];
    corrected.velocity.z = reference[5];
    /* The corrections are for a loop without feed-forward. */
    corrected.acceleration.x = corrected.acceleration.y = corrected.acceleration.z = 0.0f;
    corrected.attitude.yaw = yaw * (180.0f / 3.14159265f);
    corrected.attitudeRate.roll = corrected.attitudeRate.pitch = corrected.attitudeRate.yaw = 0.0f;
    corrected.mode.yaw = modeAbs;
  }
  controllerMellingerFirmware(control, &corrected, sensors, state, stabilizerStep);
}

/* A new adapter, whose lanes are faded out, with the trajectory ahead of it. */
static bool prepare(void)
{
  flown = wanted;
  if (flown > MAX_PIECES || !crtpCommanderHighLevelReadTrajectory(0, flown * sizeof(struct poly4d), (uint8_t *)pieces) ||
      failed(impromptu_adapter_create_quadrotor(&adapter, sizeof adapter, &model, POSITION_RATE, 0)) ||
      failed(impromptu_adapter_defer(&adapter))) {
    return false;
  }
  tick = 0;
  job_waits = inference_waits = false;
  for (int32_t at = 0; at <= (int32_t)about.future; at++) {
    if (!push(at)) {
      return false;
    }
  }
  return true;
}

/* What the app task does in a millisecond: the network, or the start of a flight. It has the stack for it (CONFIG_APP_STACKSIZE). */
static void work(void)
{
  if (job_waits && !inference_waits) {
    IN_ORDER();
    failed(impromptu_job_run(&job, &model, &scratch, &inference));
    IN_ORDER();
    job_waits = false;
    inference_waits = true;
  }
  if (stage == PREPARING) {
    const bool prepared = prepare();
    IN_ORDER();
    if (!prepared) {
      wanted = 0;
    }
    stage = prepared ? FLYING : IDLE;
  }
}

static bool start(void)
{
  const size_t length = (size_t)(impromptu_model_end - impromptu_model_start);

  return !failed(impromptu_model_create(&model, sizeof model, impromptu_model_start, length)) &&
         !failed(impromptu_model_describe(&model, &about)) && !failed(impromptu_scratch_create(&scratch, sizeof scratch));
}

void appMain(void)
{
  const bool started = start();

  while (1) {
    if (started) {
      work();
    }
    vTaskDelay(M2T(1));
  }
}

PARAM_GROUP_START(impromptu)
PARAM_ADD(PARAM_UINT8, pieces, &wanted)
PARAM_ADD(PARAM_UINT8, lanes, &lanes)
PARAM_ADD(PARAM_INT32 | PARAM_RONLY, problem, &problem)
PARAM_GROUP_STOP(impromptu)

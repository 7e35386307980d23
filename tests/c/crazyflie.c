/*
 * The Crazyflie's controller in a small firmware (crazyflie-firmware): learns while it flies, and obeys as the firmware without
 * it. What is measured comes to `answers.bin`.
 */
#include <stdio.h>
#include <string.h>

#include "controller_impromptu.c"
#include "crazyflie-firmware/firmware.h"
#include "expect.h"

#ifndef FLIGHTS
#define FLIGHTS 40
#endif
/* Ticks, after which nothing may be left of a correction: the largest there is, 1.75 m, at 2 m/s. */
#define GONE 90

static setpoint_t told;
static uint32_t seed = 1;

void vTaskDelay(uint32_t ticks) { (void)ticks; }
void controllerMellingerFirmwareInit(void) {}
bool controllerMellingerFirmwareTest(void) { return true; }
void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }
void controllerMellingerFirmware(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                                 const stabilizerStep_t stabilizerStep)
{
  (void)control, (void)sensors, (void)state, (void)stabilizerStep;
  told = *setpoint;
}
void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t stabilizerStep)
{
  controllerMellingerFirmware(control, setpoint, sensors, state, stabilizerStep);
}

static float draw(void)
{
  seed = seed * 1664525u + 1013904223u;
  return (float)(seed >> 8) / 16777216.0f;
}

/* A vehicle with a loop that follows positions as the stock PID does, late; its rotors are off where the set-point says so. */
struct vehicle {
  struct vec position, velocity, force;
  struct vec old[3];
};

static float approach(float x, float v, float to, float stiffness, float damping) { return stiffness * (to - x) - damping * v; }

static void move(struct vehicle *v, const setpoint_t *setpoint, bool is_reference_tick)
{
  const float dt = 0.001f, lag = dt / 0.05f;
  const bool holds = is_position(setpoint), off = !holds && setpoint->thrust == 0.0f;
  struct vec asked = mkvec(0.0f, 0.0f, off ? -9.81f : holds ? 0.0f : -1.0f);

  if (holds) {
    asked = mkvec(approach(v->position.x, v->velocity.x, setpoint->position.x, 8.6f, 4.3f),
                  approach(v->position.y, v->velocity.y, setpoint->position.y, 8.6f, 4.3f),
                  approach(v->position.z, v->velocity.z, setpoint->position.z, 15.3f, 7.6f));
  }
  v->force.x += lag * (asked.x - v->force.x);
  v->force.y += lag * (asked.y - v->force.y);
  v->force.z += lag * (asked.z - v->force.z);
  v->velocity = mkvec(v->velocity.x + dt * v->force.x, v->velocity.y + dt * v->force.y, v->velocity.z + dt * v->force.z);
  v->position = mkvec(v->position.x + dt * v->velocity.x, v->position.y + dt * v->velocity.y, v->position.z + dt * v->velocity.z);
  if (v->position.z < 0.0f) {
    v->position.z = 0.0f;
    v->velocity = mkvec(0.0f, 0.0f, 0.0f);
  }
  if (is_reference_tick) {
    v->old[2] = v->old[1];
    v->old[1] = v->old[0];
    v->old[0] = v->position;
  }
}

/* Positions are two ticks old when they come. */
static state_t seen_of(const struct vehicle *v)
{
  state_t state;

  memset(&state, 0, sizeof state);
  state.position = (point_t){0, v->old[2].x, v->old[2].y, v->old[2].z};
  state.velocity = (velocity_t){0, (v->old[0].x - v->old[2].x) * 50.0f, (v->old[0].y - v->old[2].y) * 50.0f,
                                (v->old[0].z - v->old[2].z) * 50.0f};
  return state;
}

/* The firmware with the add-on and without: each has its own vehicle, and the same orders. */
static struct firmware ours, stock;
static struct vehicle flies, bare;
static setpoint_t wanted_of_ours, wanted_of_stock;
/* Ticks at which the planner of ours was the one that the commander showed last. */
static int captured;

static void order(enum order what, struct vec to, float duration)
{
  const state_t here = seen_of(&flies), there = seen_of(&bare);

  firmware_order(&ours, what, to, duration, &here);
  firmware_order(&stock, what, to, duration, &there);
}

static void step(stabilizerStep_t now)
{
  const sensorData_t sensors = {{0, 0, 0}, {0, 0, 0}};
  const bool tick = RATE_DO_EXECUTE(POSITION_RATE, now);
  const state_t here = seen_of(&flies), there = seen_of(&bare);
  control_t control;

  memset(&control, 0, sizeof control);
  firmware_now = now;
  /* The stock one last, so that the captured planner is put back to ours. */
  firmware_setpoint(&stock, &wanted_of_stock, &there, now);
  firmware_setpoint(&ours, &wanted_of_ours, &here, now);
  captured += tick && plan_seen == &ours.planner;
  plan_seen = &ours.planner;
  controllerOutOfTree(&control, &wanted_of_ours, &sensors, &here, now);
  work();
  move(&flies, &told, tick);
  move(&bare, &wanted_of_stock, tick);
}

static bool same(void) { return memcmp(&told, &wanted_of_ours, sizeof told) == 0; }

/* All but the position. */
static bool same_but_positions(void)
{
  setpoint_t own = told;

  own.position = wanted_of_ours.position;
  return memcmp(&own, &wanted_of_ours, sizeof own) == 0;
}

static float apart(void)
{
  return fabsf(told.position.x - wanted_of_ours.position.x) + fabsf(told.position.y - wanted_of_ours.position.y) +
         fabsf(told.position.z - wanted_of_ours.position.z);
}

static float behind(const struct vehicle *v, const setpoint_t *s)
{
  const float x = v->position.x - s->position.x, y = v->position.y - s->position.y, z = v->position.z - s->position.z;

  return x * x + y * y + z * z;
}

/* Whether a copy of the plan says what the commander asks for, at its tick. */
static bool foreseen(void)
{
  static struct plan copy;
  struct desired at;

  copy = sample.plan;
  plan_at(&copy, (float)firmware_now / 1000.0f, &at);
  const float errors[6] = {at.position.x - wanted_of_ours.position.x, at.position.y - wanted_of_ours.position.y,
                           at.position.z - wanted_of_ours.position.z, at.velocity.x - wanted_of_ours.velocity.x,
                           at.velocity.y - wanted_of_ours.velocity.y, at.velocity.z - wanted_of_ours.velocity.z};
  for (int i = 0; i < 6; i++) {
    if (!(fabsf(errors[i]) < 1e-3f)) {
      return false;
    }
  }
  return true;
}

static struct vec somewhere(void) { return mkvec(2.0f * draw() - 1.0f, 2.0f * draw() - 1.0f, 0.6f + 0.8f * draw()); }

int main(void)
{
  FILE *answers = fopen("answers.bin", "wb");
  const struct vec origin = {0, 0, 1};
  double first[2] = {0, 0}, last[2] = {0, 0};
  stabilizerStep_t now = 1;
  int strokes = 0, orders = 0, lasting = 0;
  float most = 0.0f;

  /* What differs between the Crazyflie and the flight stack: nose up, as the Crazyflie says it. */
  const sensorData_t turning = {{0, 0, 0}, {90.0f, -45.0f, 180.0f}};
  const state_t rolled = {.attitude = {0, 20.0f, 10.0f, -30.0f}, .position = {0, 0.01f, 0.02f, 1.03f},
                          .velocity = {0, 0.4f, -0.2f, 0.1f}, .acc = {0, 0, 0, 0.5f}};
  float measured[MEASURED];
  measure(&turning, &rolled, measured);
  EXPECT(answers && fwrite(measured, sizeof measured, 1, answers) == 1 && fclose(answers) == 0);

  EXPECT(work_start());
  controllerOutOfTreeInit();
  EXPECT(controllerOutOfTreeTest());
  memset(&wanted_of_ours, 0, sizeof wanted_of_ours);
  memset(&wanted_of_stock, 0, sizeof wanted_of_stock);

  for (int flight = 0; flight < FLIGHTS; flight++) {
    const bool learning = flight == 0;
    const struct vec corners[4] = {{0, 0, 1}, {0.8f, -0.5f, 1.3f}, {-0.4f, 0.6f, 0.7f}, {0, 0, 1}};
    for (int i = 0; i < 3; i++) {
      firmware_piece(&ours.pieces[i], corners[i], corners[i + 1], 1.6f);
    }
    memcpy(stock.pieces, ours.pieces, sizeof stock.pieces);
    order(TAKE_OFF, origin, 2.0f);
    for (int i = 0; i < 2500; i++, now++) {
      step(now);
      /* A take-off is flown bare. */
      EXPECT(same() || i >= 2000);
    }
    /* A while of flight: strokes one after another. */
    const int ticks = learning ? 60000 : (int)(12000.0f * draw());
    for (int i = 0; i < ticks; i++, now++) {
      if (i % 6000 == 0) {
        const enum order kinds[3] = {TRAJECTORY, REVERSED, COMPRESSED};
        order(kinds[(int)(3.0f * draw()) % 3], origin, 0.9f + 0.3f * draw());
        strokes++;
      } else if (i % 6000 == 4900) {
        order(GO_TO, learning ? origin : somewhere(), 1.0f);
      }
      step(now);
      EXPECT(same_but_positions());
      EXPECT(!(corrects && RATE_DO_EXECUTE(POSITION_RATE, now)) || foreseen());
      most = fmaxf(most, apart());
      if (learning && (i < 6000 || i >= 54000)) {
        double *sums = i < 6000 ? first : last;
        sums[0] += (double)behind(&flies, &wanted_of_ours);
        sums[1] += (double)behind(&bare, &wanted_of_stock);
      }
    }
    /* At any moment it ends. */
    const enum order ends[5] = {LAND, STOP, LOW_BATTERY, LINK_LOSS, STREAM};
    const enum order end = learning ? LAND : ends[(int)(5.0f * draw()) % 5];
    const struct vec here = {flies.position.x, flies.position.y, flies.position.z};
    order(end, here, 2.0f);
    orders++;
    float before = apart();
    for (int i = 0; i < 3000; i++, now++) {
      step(now);
      const bool tick_of_it = RATE_DO_EXECUTE(POSITION_RATE, now);
      /* All that the commander and the supervisor say is obeyed, and what is left of a correction only goes away. */
      EXPECT(same_but_positions());
      EXPECT(is_position(&wanted_of_ours) || same());
      if (tick_of_it) {
        EXPECT(apart() <= before + 1e-5f || i < 10);
        before = apart();
      }
      EXPECT(i < 10 * GONE || same());
      lasting += i < 10 * GONE && !same();
      /* Motors are off when they are without the add-on, and not before. */
      const bool off = !is_position(&told) && told.thrust == 0.0f, off_there = !is_position(&wanted_of_stock) && wanted_of_stock.thrust == 0.0f;
      EXPECT(off == off_there);
      EXPECT(!(end == LAND && off) || flies.position.z < bare.position.z + 0.05f);
    }
    ours.streams = stock.streams = ours.levels = stock.levels = ours.lost = stock.lost = false;
    order(STOP, origin, 1.0f);
    for (int i = 0; i < 2000; i++, now++) {
      step(now);
      EXPECT(same());
    }
  }
  /* A go-to that is too fast for the vehicle leaves it far behind: that is named, and nothing else went wrong. */
  EXPECT((problem == 0 || problem == PROBLEM_FAR) && captured > 10000);
  printf("{\"strokes\":%d,\"orders\":%d,\"lasting\":%d,\"most\":%f,\"first\":%f,\"last\":%f,\"stock\":%f,\"learned_s\":%f,\"late\":%d}\n",
         strokes, orders, lasting, (double)most, sqrt(first[0] / 6000), sqrt(last[0] / 6000), sqrt(last[1] / 6000),
         (double)work_learned, (int)late);
  return 0;
}

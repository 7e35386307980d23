/*
 * The Crazyflie's controller with a stock controller and a trajectory memory that only remember: flies a straight
 * line and writes what the stock controller was told at every reference tick to `answers.bin`.
 */
#include <stdio.h>
#include <string.h>

#include "controller_impromptu.c"

static setpoint_t told;

void vTaskDelay(uint32_t ticks) { (void)ticks; }
void controllerMellingerFirmwareInit(void) {}
bool controllerMellingerFirmwareTest(void) { return true; }
void controllerMellingerFirmware(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                                 const stabilizerStep_t stabilizerStep)
{
  (void)control, (void)sensors, (void)state, (void)stabilizerStep;
  told = *setpoint;
}

/* Two pieces of a second: along a line, then on along it. */
bool crtpCommanderHighLevelReadTrajectory(const uint32_t offset, const uint32_t length, uint8_t *destination)
{
  const struct poly4d line[2] = {
      {{{0.0f, 0.5f}, {0.0f, -0.25f}, {1.0f, 0.125f}, {0.0f, 0.5f}}, 1.0f},
      {{{0.5f, 0.5f}, {-0.25f, -0.25f}, {1.125f, 0.125f}, {0.5f, 0.5f}}, 1.0f},
  };

  memcpy(destination, (const uint8_t *)line + offset, length);
  return length <= sizeof line;
}

struct traj_eval poly4d_eval(struct poly4d const *p, float t)
{
  struct traj_eval now;

  memset(&now, 0, sizeof now);
  now.pos = (struct vec){p->p[0][0] + p->p[0][1] * t, p->p[1][0] + p->p[1][1] * t, p->p[2][0] + p->p[2][1] * t};
  now.vel = (struct vec){p->p[0][1], p->p[1][1], p->p[2][1]};
  now.yaw = p->p[3][0] + p->p[3][1] * t;
  return now;
}

#define EXPECT(condition)                                             \
  do {                                                                \
    if (!(condition)) {                                               \
      fprintf(stderr, "line %d: %s (problem %d)\n", __LINE__, #condition, (int)problem); \
      return 1;                                                       \
    }                                                                 \
  } while (0)

int main(void)
{
  FILE *answers = fopen("answers.bin", "wb");
  control_t control = {0};
  setpoint_t hover;
  sensorData_t sensors = {.gyro = {90.0f, -45.0f, 180.0f}};
  /* Nose up, as the Crazyflie says it. */
  state_t state = {.attitude = {0, 20.0f, 10.0f, -30.0f}, .position = {0, 0.01f, 0.02f, 1.03f}, .velocity = {0, 0.4f, -0.2f, 0.1f}};
  float measured[MEASURED];

  memset(&hover, 0, sizeof hover);
  hover.position.z = 1.0f;
  hover.acceleration.x = 3.0f;
  hover.mode.x = hover.mode.y = hover.mode.z = modeAbs;
  state.acc.z = 0.5f;
  EXPECT(answers && start());
  controllerOutOfTreeInit();
  EXPECT(controllerOutOfTreeTest());

  for (stabilizerStep_t step = 1; step <= 3000; step++) {
    const int32_t before = tick;
    if (step == 100) {
      wanted = 2;
    }
    if (step == 2950) {
      wanted = 0;
    }
    controllerOutOfTree(&control, &hover, &sensors, &state, step);
    if (step < 100 || step > 2960) {
      /* What is not corrected is not touched. */
      EXPECT(memcmp(&told, &hover, sizeof told) == 0);
    }
    if (tick > before) {
      const float numbers[7] = {told.position.x, told.position.y, told.position.z, told.velocity.x,
                                told.velocity.y, told.velocity.z, told.attitude.yaw};
      EXPECT(fwrite(numbers, sizeof numbers, 1, answers) == 1);
      EXPECT(told.acceleration.x == 0.0f);
    }
    work();
  }
  EXPECT(problem == IMPROMPTU_STATUS_OK && stage == IDLE);
  measure(&sensors, &state, measured);
  EXPECT(fwrite(measured, sizeof measured, 1, answers) == 1);
  EXPECT(fclose(answers) == 0);
  printf("{\"ticks\":%d}\n", (int)tick);
  return 0;
}

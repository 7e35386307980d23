/* A small firmware that stands for the Crazyflie's: a commander with a planner of its own, a supervisor, a loop and a vehicle. */
#pragma once
#include "planner.h"
#include "stabilizer_types.h"

enum order { NOTHING, TAKE_OFF, GO_TO, TRAJECTORY, REVERSED, COMPRESSED, LAND, STOP, LOW_BATTERY, LINK_LOSS, STREAM };

struct firmware {
  struct planner planner;
  struct piecewise_traj uploaded;
  struct piecewise_traj_compressed compressed;
  struct poly4d pieces[3];
  /* What is streamed, in the place of the plan. */
  bool streams, levels, lost;
  struct vec last;
};

/* Milliseconds since the start. */
extern uint32_t firmware_now;

/* Motion from rest to rest along one axis, as a polynomial of 7th order. */
void firmware_piece(struct poly4d *piece, struct vec from, struct vec to, float duration);
void firmware_order(struct firmware *f, enum order order, struct vec to, float duration, const state_t *state);
/* What the stabilizer task gets before it calls the controller. */
void firmware_setpoint(struct firmware *f, setpoint_t *setpoint, const state_t *state, stabilizerStep_t step);

/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdbool.h>
#include "math3d.h"
#define PP_SIZE 8
struct poly4d { float p[4][PP_SIZE]; float duration; };
struct traj_eval { struct vec pos, vel, acc, jerk, omega; float yaw; };
struct piecewise_traj {
  float t_begin, timescale;
  struct vec shift;
  float shift_yaw;
  unsigned char n_pieces;
  struct poly4d *pieces;
};

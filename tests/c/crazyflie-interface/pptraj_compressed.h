/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include "pptraj.h"
struct piecewise_traj_compressed {
  float t_begin, duration, timescale;
  struct vec shift;
  const void *data;
  struct { const void *data; float t_begin_relative; struct poly4d poly4d; } current_piece;
};
struct traj_eval piecewise_compressed_eval(struct piecewise_traj_compressed *traj, float t);

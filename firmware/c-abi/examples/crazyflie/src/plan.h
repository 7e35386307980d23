/*
 * What the high-level commander has planned: its planner, captured, and the motion that it will ask for.
 *
 * The commander's planner is static. Its address is the argument of plan_is_disabled, which the commander calls at every tick:
 * the linker is told to put ours in its place (EXTRA_LDFLAGS in the Makefile), which remembers the planner and answers the same.
 * The make file looks into what was linked, and fails if the commander does not call it.
 */
#pragma once
#include <stdbool.h>

#include "planner.h"

/* A plan as it was at a tick, to be looked into by a task of lower priority while the commander goes on. */
struct plan {
  bool compressed, reversed;
  union {
    struct piecewise_traj pieces;
    struct piecewise_traj_compressed compact;
  };
  /* The one piece of a plan of the commander's own. */
  struct poly4d own;
};

/* What is desired at a time. */
struct desired {
  struct vec position, velocity, acceleration;
  float yaw;
};

/* The commander's planner; NULL until it was seen. */
extern const struct planner *volatile plan_seen;

/* Copies what is planned. In the stabilizer task alone, which the commander's task cannot interrupt. */
void plan_copy(const struct planner *planner, struct plan *plan);
bool plan_is(const struct planner *planner, const struct plan *plan);
/* What a plan asks for at a time, s, as the commander will; beyond its end it stands still. */
void plan_at(struct plan *plan, float time, struct desired *desired);

/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdbool.h>
#include "pptraj.h"
#include "pptraj_compressed.h"
enum trajectory_state { TRAJECTORY_STATE_IDLE = 0, TRAJECTORY_STATE_FLYING = 1, TRAJECTORY_STATE_LANDING = 3, TRAJECTORY_STATE_DISABLED = 4 };
enum trajectory_type { TRAJECTORY_TYPE_PIECEWISE = 0, TRAJECTORY_TYPE_PIECEWISE_COMPRESSED = 1 };
struct planner {
  enum trajectory_state state;
  enum trajectory_type type;
  bool reversed;
  union {
    const struct piecewise_traj *trajectory;
    struct piecewise_traj_compressed *compressed_trajectory;
  };
  struct piecewise_traj planned_trajectory;
  struct poly4d pieces[1];
};
bool plan_is_disabled(struct planner *p);

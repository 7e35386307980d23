/* What the app task does for the stabilizer task: all that is heavy. One sample goes to it at each tick of the references, one correction comes back. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#include "plan.h"

/* Channels of the flight stack's signals (see impromptu_adapter_create_quadrotor). */
#define DESIRED 10
#define MEASURED 13
#define REFERENCE 6

/* The controller that is corrected. */
enum inner { INNER_PID = 1, INNER_MELLINGER = 2 };

struct sample {
  int32_t tick;
  float time;             /* of the commander, s */
  float measured[MEASURED];
  uint8_t inner, lanes;   /* see the parameters */
  bool flies;             /* in the air, on a plan that is corrected */
  bool replanned;         /* this is not the plan of the sample before */
  bool forget;
  struct plan plan;
};

struct correction {
  int32_t tick;           /* at which it is to be flown */
  float of[REFERENCE];    /* position, m, and velocity, m/s */
};

/* An impromptu_status, or one of these. */
enum { PROBLEM_NO_PLANNER = 1000, PROBLEM_FAR = 1001, PROBLEM_FLOOR = 1002, PROBLEM_LATE = 1003 };
extern int32_t work_problem;
/* For the logs: least time that an axis has learned from, s, and the share of its corrections that acts. */
extern float work_learned, work_share;

bool work_start(void);
/* Takes a sample, and gives the correction of the next tick. */
void work_do(struct sample *sample, struct correction *correction);

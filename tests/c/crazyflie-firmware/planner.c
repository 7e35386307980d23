/* Apart from the commander that calls it, as in the firmware: so that the linker can put another one in its place. */
#include "planner.h"

bool plan_is_disabled(struct planner *p) { return p->state == TRAJECTORY_STATE_DISABLED; }

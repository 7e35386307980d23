#include <math.h>
#include <string.h>

#include "plan.h"

const struct planner *volatile plan_seen;

bool __wrap_plan_is_disabled(struct planner *p);
bool __wrap_plan_is_disabled(struct planner *p)
{
  plan_seen = p;
  return p->state == TRAJECTORY_STATE_DISABLED;
}

void plan_copy(const struct planner *planner, struct plan *plan)
{
  memset(plan, 0, sizeof *plan);
  plan->reversed = planner->reversed;
  plan->compressed = planner->type == TRAJECTORY_TYPE_PIECEWISE_COMPRESSED;
  if (plan->compressed) {
    plan->compact = *planner->compressed_trajectory;
  } else {
    plan->pieces = *planner->trajectory;
    plan->own = planner->pieces[0];
  }
}

/* Uploaded pieces stay where they are, as the commander has them; what tells a plan from the last one is who begins when, and where. */
bool plan_is(const struct planner *planner, const struct plan *plan)
{
  const bool compressed = planner->type == TRAJECTORY_TYPE_PIECEWISE_COMPRESSED;

  if (compressed != plan->compressed || planner->reversed != plan->reversed) {
    return false;
  }
  if (compressed) {
    const struct piecewise_traj_compressed *now = planner->compressed_trajectory, *then = &plan->compact;
    return now->t_begin == then->t_begin && now->data == then->data && memcmp(&now->shift, &then->shift, sizeof now->shift) == 0;
  }
  return memcmp(planner->trajectory, &plan->pieces, sizeof plan->pieces) == 0 &&
         (planner->trajectory != &planner->planned_trajectory || memcmp(planner->pieces, &plan->own, sizeof plan->own) == 0);
}

/* Value, and first and second derivative, of a polynomial. */
static void polynomial(const float p[PP_SIZE], float t, float out[3])
{
  out[0] = out[1] = out[2] = 0.0f;
  for (int i = PP_SIZE - 1; i >= 0; i--) {
    out[2] = out[2] * t + out[1];
    out[1] = out[1] * t + out[0];
    out[0] = out[0] * t + p[i];
  }
  out[2] *= 2.0f;
}

static struct vec turned(struct vec v, float c, float s)
{
  return mkvec(c * v.x - s * v.y, s * v.x + c * v.y, v.z);
}

static void pieces_at(const struct plan *plan, float time, struct desired *desired)
{
  const struct piecewise_traj *whole = &plan->pieces;
  const int count = whole->n_pieces, step = plan->reversed ? -1 : 1;
  /* A plan of the commander's own is the copy. */
  const struct poly4d *pieces = whole->pieces == plan_seen->pieces ? &plan->own : whole->pieces;
  const struct poly4d *piece = plan->reversed ? &pieces[count - 1] : pieces;
  float t = (time - whole->t_begin) / whole->timescale, moves = 1.0f / whole->timescale;
  float x[3], y[3], z[3], w[3];

  t = t < 0.0f ? 0.0f : t;
  for (int left = count; t > piece->duration; left--) {
    if (left <= 1) {
      t = piece->duration;
      moves = 0.0f;
      break;
    }
    t -= piece->duration;
    piece += step;
  }
  t = plan->reversed ? piece->duration - t : t;
  polynomial(piece->p[0], t, x);
  polynomial(piece->p[1], t, y);
  polynomial(piece->p[2], t, z);
  polynomial(piece->p[3], t, w);
  const float slower = plan->reversed ? -moves : moves;
  desired->position = mkvec(x[0], y[0], z[0]);
  desired->velocity = mkvec(x[1] * slower, y[1] * slower, z[1] * slower);
  desired->acceleration = mkvec(x[2] * moves * moves, y[2] * moves * moves, z[2] * moves * moves);
  desired->yaw = w[0];
#ifdef IMPROMPTU_SHIFT_YAW
  /* The commander does not turn what it flies in reverse. */
  if (!plan->reversed && whole->shift_yaw != 0.0f) {
    const float c = cosf(whole->shift_yaw), s = sinf(whole->shift_yaw);
    desired->position = turned(desired->position, c, s);
    desired->velocity = turned(desired->velocity, c, s);
    desired->acceleration = turned(desired->acceleration, c, s);
    desired->yaw += whole->shift_yaw;
  }
#else
  (void)turned;
#endif
  desired->position = mkvec(desired->position.x + whole->shift.x, desired->position.y + whole->shift.y,
                            desired->position.z + whole->shift.z);
}

void plan_at(struct plan *plan, float time, struct desired *desired)
{
  if (plan->compressed) {
    /* It works on the copy, and on nothing else. */
    const struct traj_eval now = piecewise_compressed_eval(&plan->compact, time);
    *desired = (struct desired){now.pos, now.vel, now.acc, now.yaw};
  } else {
    pieces_at(plan, time, desired);
  }
}

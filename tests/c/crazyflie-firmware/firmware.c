/* See firmware.h. What it does follows the firmware's documentation and what was recorded of it: who ends what, and by what set-point. */
#include <string.h>

#include "firmware.h"
#include "usec_time.h"

uint32_t firmware_now;

uint64_t usecTimestamp(void) { return (uint64_t)firmware_now * 1000u; }

void firmware_piece(struct poly4d *piece, struct vec from, struct vec to, float duration)
{
  const float a[3] = {from.x, from.y, from.z}, b[3] = {to.x, to.y, to.z};

  memset(piece, 0, sizeof *piece);
  piece->duration = duration;
  for (int axis = 0; axis < 3; axis++) {
    const float way = b[axis] - a[axis], d = duration, d4 = d * d * d * d;
    float *p = piece->p[axis];
    p[0] = a[axis];
    p[4] = 35.0f * way / d4;
    p[5] = -84.0f * way / (d4 * d);
    p[6] = 70.0f * way / (d4 * d * d);
    p[7] = -20.0f * way / (d4 * d * d * d);
  }
}

static struct traj_eval piece_at(const struct poly4d *piece, float t, float rate)
{
  struct traj_eval e;
  float v[3], w[3], u[3];

  memset(&e, 0, sizeof e);
  for (int axis = 0; axis < 3; axis++) {
    const float *p = piece->p[axis];
    v[axis] = w[axis] = u[axis] = 0.0f;
    for (int i = PP_SIZE - 1; i >= 0; i--) {
      v[axis] = v[axis] * t + p[i];
      w[axis] = i > 0 ? w[axis] * t + (float)i * p[i] : w[axis];
      u[axis] = i > 1 ? u[axis] * t + (float)(i * (i - 1)) * p[i] : u[axis];
    }
  }
  e.pos = mkvec(v[0], v[1], v[2]);
  e.vel = mkvec(w[0] * rate, w[1] * rate, w[2] * rate);
  e.acc = mkvec(u[0] * rate * rate, u[1] * rate * rate, u[2] * rate * rate);
  return e;
}

static float length(const struct piecewise_traj *whole)
{
  float sum = 0.0f;

  for (int i = 0; i < whole->n_pieces; i++) {
    sum += whole->pieces[i].duration * whole->timescale;
  }
  return sum;
}

static struct traj_eval whole_at(const struct piecewise_traj *whole, bool reversed, float time)
{
  const float all = length(whole), since = time - whole->t_begin;
  const bool over = since > all;
  float t = (reversed ? (over ? 0.0f : all - since) : (over ? all : since)) / whole->timescale;
  int i = 0;

  while (i + 1 < whole->n_pieces && t > whole->pieces[i].duration) {
    t -= whole->pieces[i++].duration;
  }
  struct traj_eval e = piece_at(&whole->pieces[i], t, (reversed ? -1.0f : 1.0f) / whole->timescale);
  if (over) {
    e.vel = e.acc = mkvec(0.0f, 0.0f, 0.0f);
  }
  e.pos = mkvec(e.pos.x + whole->shift.x, e.pos.y + whole->shift.y, e.pos.z + whole->shift.z);
  return e;
}

struct traj_eval piecewise_compressed_eval(struct piecewise_traj_compressed *traj, float t)
{
  const float since = t - traj->t_begin;
  struct traj_eval e = piece_at(&traj->current_piece.poly4d, since > traj->duration ? traj->duration : since, 1.0f);

  e.pos = mkvec(e.pos.x + traj->shift.x, e.pos.y + traj->shift.y, e.pos.z + traj->shift.z);
  return e;
}

void firmware_order(struct firmware *f, enum order order, struct vec to, float duration, const state_t *state)
{
  struct planner *p = &f->planner;
  const bool idle = p->state == TRAJECTORY_STATE_IDLE || p->state == TRAJECTORY_STATE_DISABLED;
  const struct vec here = idle ? mkvec(state->position.x, state->position.y, state->position.z) : f->last;
  const float now = (float)firmware_now / 1000.0f;

  switch (order) {
    case TAKE_OFF:
    case GO_TO:
    case LAND:
      p->planned_trajectory = (struct piecewise_traj){now, 1.0f, {0, 0, 0}, 0.0f, 1, p->pieces};
      firmware_piece(&p->pieces[0], here, order == GO_TO ? to : mkvec(here.x, here.y, order == LAND ? 0.0f : to.z), duration);
      p->type = TRAJECTORY_TYPE_PIECEWISE;
      p->trajectory = &p->planned_trajectory;
      p->reversed = false;
      p->state = order == LAND ? TRAJECTORY_STATE_LANDING : TRAJECTORY_STATE_FLYING;
      f->streams = false;
      break;
    case TRAJECTORY:
    case REVERSED:
      f->uploaded = (struct piecewise_traj){now, duration, {0, 0, 0}, 0.0f, 3, f->pieces};
      p->reversed = order == REVERSED;
      const struct traj_eval begin = whole_at(&f->uploaded, p->reversed, now);
      f->uploaded.shift = mkvec(here.x - begin.pos.x, here.y - begin.pos.y, here.z - begin.pos.z);
      p->type = TRAJECTORY_TYPE_PIECEWISE;
      p->trajectory = &f->uploaded;
      p->state = TRAJECTORY_STATE_FLYING;
      break;
    case COMPRESSED:
      f->compressed = (struct piecewise_traj_compressed){now, f->pieces[0].duration, 1.0f, {0, 0, 0}, f->pieces, {f->pieces, 0.0f, f->pieces[0]}};
      f->compressed.shift = mkvec(here.x - f->pieces[0].p[0][0], here.y - f->pieces[0].p[1][0], here.z - f->pieces[0].p[2][0]);
      p->reversed = false;
      p->type = TRAJECTORY_TYPE_PIECEWISE_COMPRESSED;
      p->compressed_trajectory = &f->compressed;
      p->state = TRAJECTORY_STATE_FLYING;
      break;
    case STOP: p->state = TRAJECTORY_STATE_IDLE; break;
    case LOW_BATTERY: f->levels = true; break;
    case LINK_LOSS: f->lost = true; break;
    case STREAM:
      f->streams = true;
      f->last = to;
      p->state = TRAJECTORY_STATE_IDLE;
      break;
    default: break;
  }
}

static void hold(setpoint_t *setpoint, const struct traj_eval *e)
{
  memset(setpoint, 0, sizeof *setpoint);
  setpoint->position.x = e->pos.x;
  setpoint->position.y = e->pos.y;
  setpoint->position.z = e->pos.z;
  setpoint->velocity.x = e->vel.x;
  setpoint->velocity.y = e->vel.y;
  setpoint->velocity.z = e->vel.z;
  setpoint->acceleration.x = e->acc.x;
  setpoint->acceleration.y = e->acc.y;
  setpoint->acceleration.z = e->acc.z;
  setpoint->mode.x = setpoint->mode.y = setpoint->mode.z = setpoint->mode.yaw = modeAbs;
}

void firmware_setpoint(struct firmware *f, setpoint_t *setpoint, const state_t *state, stabilizerStep_t step)
{
  struct planner *p = &f->planner;
  const float now = (float)firmware_now / 1000.0f;
  struct traj_eval e;

  (void)state;
  if (RATE_DO_EXECUTE(POSITION_RATE, step)) {
    const bool follows = p->state == TRAJECTORY_STATE_FLYING || p->state == TRAJECTORY_STATE_LANDING;
    memset(&e, 0, sizeof e);
    if (follows) {
      const bool compressed = p->type == TRAJECTORY_TYPE_PIECEWISE_COMPRESSED;
      e = compressed ? piecewise_compressed_eval(p->compressed_trajectory, now) : whole_at(p->trajectory, p->reversed, now);
      if (p->state == TRAJECTORY_STATE_LANDING && now - p->trajectory->t_begin >= length(p->trajectory)) {
        p->state = TRAJECTORY_STATE_IDLE;
      }
    }
    if (f->streams) {
      e.pos = f->last;
      hold(setpoint, &e);
    } else if (plan_is_disabled(p) || p->state == TRAJECTORY_STATE_IDLE) {
      memset(setpoint, 0, sizeof *setpoint);
    } else {
      hold(setpoint, &e);
      f->last = e.pos;
    }
  }
  /* The supervisor: level out with what thrust there is, then nothing. */
  if (f->levels || f->lost) {
    memset(setpoint, 0, sizeof *setpoint);
    setpoint->mode.roll = setpoint->mode.pitch = modeAbs;
    setpoint->mode.yaw = modeVelocity;
    setpoint->thrust = f->lost ? 30000.0f : 0.0f;
  }
}

/*
 * Learns corrections in flight, an axis an object, and adds those of a model if one is compiled in.
 *
 * What is measured at a tick corrects the next one. So the trajectory is looked at from there, and nothing is lost of what is
 * foreseen; what is fed back is a tick older, which the learners are told.
 */
#include <math.h>
#include <stddef.h>

#include "stabilizer_types.h"

#include "impromptu.h"
#include "work.h"

#define AXES 3
#define RATE 100.0f
/* Samples ahead of the tick that is corrected. */
#define AHEAD 80
/* How old a position is when it comes, s: by motion capture over the radio. Of sensors on board it is less, which does no harm. */
#define AGE 0.024f
/* From what the position loop asks for to the vehicle's acceleration, s. */
#define ATTITUDE 0.055f
/* What corrections may ask a loop for, m/s^2: in a calm motion, and at most; how far they may go beyond what the motion needs. */
#define CALM 6.5f
#define MOST 15.0f
static const float margin[AXES] = {6.0f, 6.0f, 4.0f};

/*
 * The loops as their gains say: acceleration for an error of position, 1/s^2, and of velocity, 1/s. PID: 25 degrees for 1 m/s, 2
 * m/s for 1 m; up, a thousandth of the thrust. Mellinger: its gains over the mass. `told`: it is told velocities too.
 */
static const struct {
  float stiffness[AXES], damping[AXES];
  bool told;
} loops[] = {
    [INNER_PID] = {{8.6f, 8.6f, 15.3f}, {4.3f, 4.3f, 7.6f}, false},
    [INNER_MELLINGER] = {{13.3f, 13.3f, 41.7f}, {6.7f, 6.7f, 13.3f}, true},
};

int32_t work_problem;
float work_learned, work_share;

static impromptu_learner learners[AXES];
static uint8_t learns; /* the inner controller beside which they learn */
static int32_t pushed; /* tick of the next sample of the trajectory */
static bool flew;

static bool failed(impromptu_status status)
{
  /* What is missing for a tick is no problem of the installation. */
  if (status != IMPROMPTU_STATUS_OK && status != IMPROMPTU_STATUS_NO_TRAJECTORY && status != IMPROMPTU_STATUS_BAD_SAMPLE) {
    work_problem = status;
  }
  return status != IMPROMPTU_STATUS_OK;
}

#ifdef IMPROMPTU_WITH_MODEL
/* The model file, linked in: see the Kbuild file. */
extern const uint8_t impromptu_model_start[];
extern const uint8_t impromptu_model_end[];

static impromptu_model model;
static impromptu_adapter adapter;
static bool modelled;

static bool model_start(void)
{
  const size_t length = (size_t)(impromptu_model_end - impromptu_model_start);

  modelled = !failed(impromptu_model_create(&model, sizeof model, impromptu_model_start, length)) &&
             !failed(impromptu_adapter_create_quadrotor(&adapter, sizeof adapter, &model, RATE, 0));
  return modelled;
}

static void model_plan(int32_t from, bool anew)
{
  if (modelled) {
    failed(anew ? impromptu_adapter_restart(&adapter, from) : impromptu_adapter_replan(&adapter, from));
  }
}

static void model_push(const struct desired *at)
{
  const float desired[DESIRED] = {at->position.x, at->position.y, at->position.z, at->velocity.x, at->velocity.y,
                                  at->velocity.z, at->acceleration.x, at->acceleration.y, at->acceleration.z, at->yaw};

  if (modelled) {
    failed(impromptu_adapter_push(&adapter, desired, DESIRED));
  }
}

/* What the learners are told of it is the feedback lane's part. */
static void model_correct(const struct sample *sample, const struct desired *now, struct correction *correction)
{
  const float desired[REFERENCE] = {now->position.x, now->position.y, now->position.z,
                                    now->velocity.x, now->velocity.y, now->velocity.z};
  float reference[REFERENCE], fed_back[REFERENCE];
  /* On the stack, which has room for it after the model was checked on it. */
  impromptu_scratch scratch;

  if (!modelled || failed(impromptu_scratch_create(&scratch, sizeof scratch))) {
    return;
  }
  failed(impromptu_adapter_switch(&adapter, sample->lanes & 2, sample->lanes & 4));
  failed(impromptu_adapter_set_airborne(&adapter, sample->flies));
  if (!failed(impromptu_adapter_step(&adapter, &scratch, sample->tick + 1, sample->measured, MEASURED, reference, REFERENCE))) {
    for (int i = 0; i < REFERENCE; i++) {
      correction->of[i] = reference[i] - desired[i];
    }
  }
  if (!failed(impromptu_adapter_fed_back(&adapter, fed_back, REFERENCE))) {
    for (int axis = 0; axis < AXES; axis++) {
      failed(impromptu_learner_tell_other(&learners[axis], fed_back[axis]));
    }
  }
}
#else
static bool model_start(void) { return true; }
static void model_plan(int32_t from, bool anew) { (void)from, (void)anew; }
static void model_push(const struct desired *at) { (void)at; }
static void model_correct(const struct sample *sample, const struct desired *now, struct correction *correction)
{
  (void)sample, (void)now, (void)correction;
}
#endif

/* Learners that have learned nothing, beside an inner controller. */
static bool begin(uint8_t inner, int32_t tick)
{
  for (uint32_t axis = 0; axis < AXES; axis++) {
    const float stiffness = loops[inner].stiffness[axis], frequency = sqrtf(stiffness);
    const impromptu_learner_settings settings = {
        .rate_hz = RATE,
        .age_s = AGE + 1.0f / RATE,
        .axis = axis,
        .gain = 1.0f,
        .frequency = frequency,
        .damping = 0.5f * loops[inner].damping[axis] / frequency,
        .delay_s = AGE + ATTITUDE + 1.0f / RATE,
        .scale = CALM / stiffness,
        .correction = MOST / stiffness,
        .feedback = 0.3f * CALM / stiffness,
        .rate = 20.0f * MOST / stiffness,
        .probe_size = 0.05f,
        .probe_s = 15.3f / frequency,
        .identity = inner,
    };
    if (failed(impromptu_learner_create(&learners[axis], sizeof learners[axis], &settings, tick)) ||
        failed(impromptu_learner_learn(&learners[axis]))) {
      return false;
    }
  }
  learns = inner;
  return true;
}

/* Samples of the plan up to where it is looked at. */
static void push(struct sample *sample)
{
  for (; pushed <= sample->tick + 1 + AHEAD; pushed++) {
    struct desired at;
    plan_at(&sample->plan, sample->time + (float)(pushed - sample->tick) / RATE, &at);
    const float position[AXES] = {at.position.x, at.position.y, at.position.z};
    for (int axis = 0; axis < AXES; axis++) {
      failed(impromptu_learner_push(&learners[axis], position[axis]));
    }
    model_push(&at);
  }
}

bool work_start(void)
{
  return model_start();
}

/* A correction may go as far as what the desired motion needs, and a little further. */
static void bound(int axis, uint8_t inner, float acceleration, float velocity)
{
  const float stiffness = loops[inner].stiffness[axis];
  const float needs = acceleration + (loops[inner].told ? 0.0f : loops[inner].damping[axis] * velocity);
  const float low = fminf(0.0f, fminf(acceleration, needs)) - margin[axis];
  const float high = fmaxf(0.0f, fmaxf(acceleration, needs)) + margin[axis];

  failed(impromptu_learner_bound(&learners[axis], low / stiffness, high / stiffness));
}

void work_do(struct sample *sample, struct correction *correction)
{
  const int32_t next = sample->tick + 1;
  struct desired now;
  impromptu_progress progress;

  *correction = (struct correction){.tick = next};
  if (learns != sample->inner && !begin(sample->inner, next)) {
    return;
  }
  if (sample->forget) {
    for (int axis = 0; axis < AXES; axis++) {
      failed(impromptu_learner_forget(&learners[axis]));
    }
  }
  if (!sample->flies) {
    flew = false;
    return;
  }
  if (!flew || sample->replanned) {
    for (int axis = 0; axis < AXES; axis++) {
      failed(flew ? impromptu_learner_replan(&learners[axis], next) : impromptu_learner_restart(&learners[axis], next));
    }
    model_plan(next, !flew);
    pushed = next;
    flew = true;
  }
  push(sample);
  plan_at(&sample->plan, sample->time + 1.0f / RATE, &now);
  model_correct(sample, &now, correction);
  const float velocity[AXES] = {now.velocity.x, now.velocity.y, now.velocity.z};
  const float acceleration[AXES] = {now.acceleration.x, now.acceleration.y, now.acceleration.z};
  work_learned = work_share = INFINITY;
  for (int axis = 0; axis < AXES; axis++) {
    float learned = 0.0f;
    bound(axis, sample->inner, acceleration[axis], velocity[axis]);
    /* Written also where a sample was missing. */
    failed(sample->lanes & 1 ? impromptu_learner_learn(&learners[axis]) : impromptu_learner_stop(&learners[axis]));
    failed(impromptu_learner_step(&learners[axis], next, sample->measured[axis], sample->measured[3 + axis], 1, &learned));
    correction->of[axis] += learned;
    if (!failed(impromptu_learner_report(&learners[axis], &progress))) {
      work_learned = fminf(work_learned, progress.learned_s);
      work_share = fminf(work_share, progress.share);
    }
  }
}

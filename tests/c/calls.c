/*
 * Calls the whole C face in random order, with what it must take and with what it must refuse: NULL, misaligned pointers, memory
 * that is too small, objects that were not created or are of another kind, counts that differ, numbers of any kind. The model's
 * file is `model.bin`. A refused call must change nothing. Beside each adapter and flight stack stands another one that is told
 * the same but for the lanes, which stay off: from its reference a correction is known.
 */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "impromptu.h"

#ifndef SEED
#define SEED 1u
#endif
#ifndef CALLS
#define CALLS 200000u
#endif

#define MODEL_LIMIT 24576
#define PAIRS 2
#define DESIRED 10
#define MEASURED 13
#define REFERENCE 6
/* Values that a pointer of the right kind points to, whatever count is told. */
#define ROOM 32
#define RATE 100.0f

/* What is not to be written: in front of an object or an output, and behind. */
#define FENCE 64
#define UNTOUCHED 0xa5

#define OBJECT(type, name)                                      \
    static struct {                                             \
        unsigned char before[FENCE];                            \
        __attribute__((aligned(16))) type object;               \
        unsigned char behind[FENCE];                            \
    } name[PAIRS]

OBJECT(impromptu_model, models);
OBJECT(impromptu_scratch, scratches);
OBJECT(impromptu_adapter, adapters);
OBJECT(impromptu_adapter, plain_adapters);
OBJECT(impromptu_flight, flights);
OBJECT(impromptu_flight, plain_flights);
/* Zeroed, as memory that never held an object. */
static impromptu_adapter nothing;
/* How an object was before a call. */
static union {
    impromptu_model model;
    impromptu_adapter adapter;
    impromptu_flight flight;
} kept;

/* The model's file; the same where it is read by slower kernels; the same with a wrong bit. */
static __attribute__((aligned(16))) uint8_t file[MODEL_LIMIT], shifted_file[MODEL_LIMIT + 1], damaged_file[MODEL_LIMIT];
static size_t length;

/* Outputs of one call. */
static __attribute__((aligned(16))) unsigned char output[FENCE + 1024 + FENCE], flag[FENCE + 16 + FENCE];
#define OUTPUT ((void *)(output + FENCE))
#define FLAG ((void *)(flag + FENCE))

static const impromptu_cap usual_caps[REFERENCE] = {{1, 40}, {1, 40}, {1, 40}, {4, 160}, {4, 160}, {4, 160}};

/* What the corrections may be, and how they were. */
struct corrections {
    float limit[REFERENCE], slew[REFERENCE], last[REFERENCE], rounding[REFERENCE];
};

/* What is known of an adapter or a flight stack; of the model that it was made of: -1, of none. */
struct known {
    int made, model;
    uint32_t tick;
    struct corrections corrections;
    float desired[REFERENCE];
    impromptu_job job;
    impromptu_inference inference;
};
static struct known adapter_known[PAIRS], flight_known[PAIRS];
static int model_made[PAIRS], scratch_made[PAIRS];

static unsigned call, done, refused, corrected, faded_in;
/* Whether this call is given something that it must refuse. */
static int spoiled;

#define FAIL(...)                                                                        \
    do {                                                                                 \
        fprintf(stderr, "line %d, seed %u, call %u: ", __LINE__, (unsigned)SEED, call); \
        fprintf(stderr, __VA_ARGS__);                                                    \
        fputc('\n', stderr);                                                             \
        return 0;                                                                        \
    } while (0)
#define EXPECT(condition)           \
    do {                            \
        if (!(condition))           \
            FAIL("%s", #condition); \
    } while (0)
/* Ends a call that failed, or was refused. */
#define JUDGE(status, may, thing)                                      \
    do {                                                               \
        int judged_ = judge((status), (may), &(thing), sizeof(thing)); \
        if (judged_ != 1)                                              \
            return judged_ != 0;                                       \
    } while (0)
#define IF_MADE(made, may) ((made) ? (uint64_t)(may) : MAY(NOT_CREATED))

/* Knuth's MMIX generator; its high bits are the good ones. */
static uint32_t word(void)
{
    static uint64_t state = SEED;

    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 32);
}

static unsigned choice(unsigned count)
{
    return (unsigned)(((uint64_t)word() * count) >> 32);
}

static float within(float limit)
{
    return limit * ((float)(word() >> 8) / 8388608.0f - 1.0f);
}

static float insane(void)
{
    static const float numbers[] = {0.0f, -0.0f, 3.4e38f, -3.4e38f, 1e-40f, 1e10f, INFINITY, -INFINITY, NAN, -1.0f};
    uint32_t bits = word();
    float number;

    if (choice(2))
        return numbers[choice(sizeof numbers / sizeof *numbers)];
    memcpy(&number, &bits, sizeof number);
    return number;
}

/* Numbers of which now and then one, or each, is of any kind. */
static void numbers(float *place, unsigned count, float limit)
{
    unsigned kind = choice(12);

    for (unsigned index = 0; index < count; index++)
        place[index] = kind == 0 ? insane() : within(limit);
    if (kind == 1)
        place[choice(count)] = insane();
}

/* A pointer, or one that must be refused. */
static void *at(void *place)
{
    switch (choice(60)) {
    case 0: spoiled = 1; return NULL;
    case 1: spoiled = 1; return (unsigned char *)place + 1;
    default: return place;
    }
}

/* An object, or a pointer that must be refused: also to memory without an object, and to an object of another kind. */
static void *object(void *place, void *other)
{
    switch (choice(60)) {
    case 0: spoiled = 1; return &nothing;
    case 1: spoiled = 1; return other;
    default: return at(place);
    }
}

static size_t counted(size_t count)
{
    size_t other = choice(20);

    if (choice(40) != 0 || other == count)
        return count;
    spoiled = 1;
    return other;
}

static size_t sized(size_t size, size_t least)
{
    if (choice(40) != 0)
        return size;
    spoiled = 1;
    return choice((unsigned)least);
}

static int32_t near(int32_t tick)
{
    switch (choice(40)) {
    case 0: return (int32_t)word();
    case 1: return (int32_t)((uint32_t)tick + choice(400) - 200);
    default: return tick;
    }
}

static int untouched(const unsigned char *from, const unsigned char *to)
{
    for (; from < to; from++)
        if (*from != UNTOUCHED)
            return 0;
    return 1;
}

/* That nothing but the first bytes of the output was written. */
static int fenced(size_t written)
{
    EXPECT(untouched(output, output + FENCE));
    EXPECT(untouched(output + FENCE + written, output + sizeof output));
    EXPECT(untouched(flag, flag + FENCE) && untouched(flag + FENCE + sizeof(int), flag + sizeof flag));
    return 1;
}

static void begin(const void *object, size_t size)
{
    spoiled = 0;
    memset(output, UNTOUCHED, sizeof output);
    memset(flag, UNTOUCHED, sizeof flag);
    memcpy(&kept, object, size);
}

#define MAY(name) (1ull << IMPROMPTU_STATUS_##name)
#define ANY_DONE (MAY(OK) | MAY(BAD_SAMPLE) | MAY(NO_TRAJECTORY))
#define FAULT (MAY(NULL) | MAY(MISALIGNED) | MAY(MEMORY) | MAY(NOT_CREATED) | MAY(COUNT) | MAY(CAPS))

/* Judges a status by those that there may be: 1 the call was done, -1 it was refused and changed nothing, 0 it is wrong. Of an
 * object as many bytes are compared as `size` says. */
static int judge(impromptu_status status, uint64_t may, const void *object, size_t size)
{
    if (spoiled)
        may = (may & ~ANY_DONE) | FAULT;
    if (status < 0 || status > 63 || !(may >> status & 1))
        FAIL("status %d, %s", (int)status, impromptu_status_text(status));
    EXPECT(strcmp(impromptu_status_text(status), impromptu_status_text(-1)) != 0);
    if (ANY_DONE >> status & 1) {
        done++;
        return 1;
    }
    if (memcmp(object, &kept, size) != 0 || !untouched(output, output + sizeof output) || !untouched(flag, flag + sizeof flag))
        FAIL("status %d, %s, and yet something was written", (int)status, impromptu_status_text(status));
    refused++;
    return -1;
}

/* Nothing is known but that it was made, of which model, and its bounds. */
static void renew(struct known *known, int model, uint32_t tick, const impromptu_cap *caps)
{
    memset(known, 0, sizeof *known);
    known->made = 1;
    known->model = model;
    known->tick = tick;
    for (unsigned channel = 0; channel < REFERENCE; channel++) {
        known->corrections.limit[channel] = caps[channel].limit;
        known->corrections.slew[channel] = caps[channel].rate / RATE;
    }
}

/* A reference must be a number near the desired one, and the correction must not jump. */
static int reference_within(struct corrections *correction, const float *reference, const float *desired)
{
    for (unsigned channel = 0; channel < REFERENCE; channel++) {
        float value = reference[channel] - desired[channel], last = correction->last[channel];
        float most = fmaxf(fabsf(reference[channel]), fabsf(desired[channel]));
        float rounding = 2.4e-7f * (most + fabsf(last));
        float slack = rounding + correction->rounding[channel];

        EXPECT(isfinite(reference[channel]) && isfinite(desired[channel]));
        if (!(fabsf(value) <= correction->limit[channel] * 1.00002f + slack))
            FAIL("channel %u: %g where %g is desired", channel, (double)reference[channel], (double)desired[channel]);
        if (!(fabsf(value - last) <= correction->slew[channel] * 1.00002f + slack))
            FAIL("channel %u: correction from %g to %g", channel, (double)last, (double)value);
        correction->last[channel] = value;
        correction->rounding[channel] = rounding;
        corrected += value != 0.0f;
    }
    return 1;
}

static int finite(const float *numbers, size_t count)
{
    for (size_t index = 0; index < count; index++)
        if (!isfinite(numbers[index]))
            return 0;
    return 1;
}

/* Whether a vehicle does this without doubt. */
static int usual(const float *numbers, size_t count)
{
    for (size_t index = 0; index < count; index++)
        if (!(fabsf(numbers[index]) <= 100.0f))
            return 0;
    return 1;
}

static int model_create(unsigned index)
{
    impromptu_model *model = &models[index].object;
    const uint8_t *bytes = file;
    size_t told = length, size, wrong = choice((unsigned)length);
    uint8_t bit = (uint8_t)(1u << choice(8));
    uint64_t may = MAY(OK);
    impromptu_status status;
    void *place;

    begin(model, sizeof *model);
    switch (choice(4)) {
    case 0:
        bytes = shifted_file + 1;
        break;
    case 1:
        told = wrong;
        may = MAY(DAMAGED) | MAY(NOT_A_MODEL);
        break;
    case 2:
        bytes = damaged_file;
        may = MAY(DAMAGED) | MAY(NOT_A_MODEL) | MAY(VERSION);
        break;
    default:
        break;
    }
    if (choice(60) == 0) {
        bytes = NULL;
        spoiled = 1;
    }
    place = at(model);
    size = sized(sizeof *model, impromptu_model_size());
    damaged_file[wrong] ^= bit;
    status = impromptu_model_create(place, size, bytes, told);
    damaged_file[wrong] ^= bit;
    /* A refused file leaves the model that was there, but it is made once more. */
    switch (judge(status, may, model, spoiled ? sizeof *model : 0)) {
    case 0: return 0;
    case 1: break;
    default: return 1;
    }
    model_made[index] = 1;
    /* What was made of the model that was there is to be forgotten. */
    for (unsigned pair = 0; pair < PAIRS; pair++) {
        if (adapter_known[pair].model == (int)index) {
            memset(&adapters[pair].object, 0, sizeof adapters[pair].object);
            adapter_known[pair].made = 0;
        }
        if (flight_known[pair].model == (int)index) {
            memset(&flights[pair].object, 0, sizeof flights[pair].object);
            flight_known[pair].made = 0;
        }
    }
    return fenced(0);
}

static int model_describe(unsigned index)
{
    static uint32_t checksum;
    impromptu_description description;
    void *model, *place;

    begin(&models[index].object, sizeof models[index].object);
    model = object(&models[index].object, &adapters[0].object);
    place = at(OUTPUT);
    JUDGE(impromptu_model_describe(model, place), IF_MADE(model_made[index], MAY(OK)), models[index].object);
    memcpy(&description, OUTPUT, sizeof description);
    EXPECT(description.channels[0] == DESIRED && description.channels[1] == MEASURED && description.channels[2] == REFERENCE);
    EXPECT(checksum == 0 || checksum == description.checksum);
    checksum = description.checksum;
    return fenced(sizeof description);
}

static int scratch_create(unsigned index)
{
    impromptu_scratch *scratch = &scratches[index].object;
    void *place;
    size_t size;

    begin(scratch, sizeof *scratch);
    place = at(scratch);
    size = sized(sizeof *scratch, 64);
    JUDGE(impromptu_scratch_create(place, size), MAY(OK), *scratch);
    scratch_made[index] = 1;
    return fenced(0);
}

static int job_run(struct known *known)
{
    unsigned index = choice(PAIRS), memory = choice(PAIRS);
    impromptu_job job = known->job;
    void *work, *model, *scratch, *place;

    begin(&models[index].object, sizeof models[index].object);
    if (choice(4) == 0)
        numbers(job.inputs, IMPROMPTU_MAX_FEATURES, 1.0f);
    work = at(&job);
    model = object(&models[index].object, &adapters[0].object);
    scratch = object(&scratches[memory].object, &models[0].object);
    place = at(OUTPUT);
    JUDGE(impromptu_job_run(work, model, scratch, place), IF_MADE(model_made[index] && scratch_made[memory], MAY(OK)),
          models[index].object);
    memcpy(&known->inference, OUTPUT, sizeof known->inference);
    EXPECT(known->inference.tick == job.tick && finite(known->inference.outputs, IMPROMPTU_MAX_OUTPUTS));
    return fenced(sizeof known->inference);
}

/* A slow trajectory: there and back. */
static void row(uint32_t tick, float *desired)
{
    int phase = (int)(tick & 511u);

    memset(desired, 0, DESIRED * sizeof *desired);
    desired[0] = 0.002f * (float)(phase < 256 ? phase : 512 - phase);
    desired[2] = 1.0f;
    desired[3] = phase < 256 ? 0.2f : -0.2f;
}

/* The table of a quadrotor's channels, in which one may be another. */
static uint64_t table(impromptu_signals *signals, impromptu_channel *rows)
{
    static const char *names[] = {"position.x",     "position.y", "position.z", "velocity.x",     "velocity.y",
                                  "velocity.z",     "roll",       "pitch",      "yaw",            "rate.x",
                                  "rate.y",         "rate.z",     "acceleration.z", "acceleration.x", "acceleration.y"};
    static const unsigned char order[DESIRED + MEASURED + REFERENCE] = {
        0, 1, 2, 3, 4, 5, 13, 14, 12, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 1, 2, 3, 4, 5};
    impromptu_channel *other;

    for (unsigned index = 0; index < sizeof order; index++) {
        unsigned name = order[index];
        int desired = index < DESIRED;
        rows[index].name = names[name];
        rows[index].unit = name < 3 ? "m" : name < 6 ? "m/s" : name < 9 ? "rad" : name < 12 ? "rad/s" : "m/s^2";
        rows[index].frame = name >= 9 && name < 12 ? "body FLU" : "world ENU";
        if (name >= 6 && name < 9 && !desired)
            rows[index].frame = "body FLU to world ENU";
        rows[index].zero_beyond = (name >= 3 && name < 6) || (name >= 12 && desired);
    }
    *signals = (impromptu_signals){rows, DESIRED, rows + DESIRED, MEASURED, rows + DESIRED + MEASURED, REFERENCE};
    other = rows + choice(sizeof order);
    switch (choice(8)) {
    case 0: other->name = "x"; return MAY(SIGNALS);
    case 1: other->unit = "\xff"; return MAY(TEXT);
    case 2: other->frame = NULL; return MAY(NULL);
    case 3: other->zero_beyond ^= 1; return MAY(SIGNALS);
    case 4: signals->measured_count = choice(MEASURED); return MAY(SIGNALS);
    case 5: signals->reference_count = 17 + choice(1000); return MAY(COUNT);
    case 6: signals->desired = NULL; return MAY(NULL);
    default: return MAY(OK);
    }
}

static int adapter_create(unsigned pair)
{
    struct known *known = &adapter_known[pair];
    impromptu_adapter *adapter = &adapters[pair].object;
    unsigned index = choice(PAIRS);
    int32_t first = choice(4) ? 0 : (int32_t)word();
    float rate = choice(30) ? RATE : within(90.0f);
    impromptu_cap caps[REFERENCE];
    impromptu_signals signals;
    impromptu_channel rows[DESIRED + MEASURED + REFERENCE];
    uint64_t wrong = rate == RATE ? 0 : MAY(RATE);
    size_t size, count = REFERENCE;
    void *place, *model, *bounds = caps;
    const impromptu_signals *told = NULL;
    impromptu_status status;
    int quadrotor = choice(3) == 0;

    begin(adapter, sizeof *adapter);
    memcpy(caps, usual_caps, sizeof caps);
    place = at(adapter);
    model = object(&models[index].object, &scratches[0].object);
    size = sized(sizeof *adapter, impromptu_adapter_size());
    if (quadrotor) {
        status = impromptu_adapter_create_quadrotor(place, size, model, rate, first);
    } else {
        if (choice(2)) {
            uint64_t as = table(&signals, rows);
            told = &signals;
            wrong |= as & ~MAY(OK);
        }
        for (unsigned channel = 0; channel < REFERENCE && choice(2); channel++) {
            impromptu_cap cap = {choice(20) ? fabsf(within(0.5f)) : insane(), choice(20) ? fabsf(within(20.0f)) : insane()};
            caps[channel] = cap;
            if (!(cap.limit >= 0.0f && cap.limit < FLT_MAX && cap.rate >= 0.0f && cap.rate < FLT_MAX))
                wrong |= MAY(CAPS);
        }
        if (choice(40) == 0) {
            bounds = NULL;
            wrong |= MAY(CAPS);
        }
        if (choice(40) == 0) {
            count = choice(20);
            if (count != REFERENCE) {
                /* As many are there as are told, at most. */
                wrong |= count > IMPROMPTU_MAX_CHANNELS ? MAY(COUNT) : MAY(CAPS);
                count = count > IMPROMPTU_MAX_CHANNELS || count < REFERENCE ? count : REFERENCE - 1;
            }
        }
        status = impromptu_adapter_create(place, size, model, told, rate, first, bounds, count);
    }
    JUDGE(status, model_made[index] ? (wrong ? wrong : MAY(OK)) : wrong | MAY(NOT_CREATED), *adapter);
    EXPECT(impromptu_adapter_create(&plain_adapters[pair].object, sizeof *adapter, &models[index].object, NULL, RATE, first,
                                    caps, REFERENCE) == IMPROMPTU_STATUS_OK);
    renew(known, (int)index, (uint32_t)first, caps);
    return fenced(0);
}

/* The same call with the adapter that may be wrong, and, if it is done, with the one whose lanes stay off. */
#define ADAPTER_CALL(may, name, ...)                                                                          \
    do {                                                                                                      \
        impromptu_status status_ = impromptu_adapter_##name(place, __VA_ARGS__);                             \
        JUDGE(status_, IF_MADE(known->made, may), adapters[pair].object);                                     \
        EXPECT(impromptu_adapter_##name(&plain_adapters[pair].object, __VA_ARGS__) == status_);              \
    } while (0)

/* As much of the trajectory as the model looks at. */
static int adapter_follow(unsigned pair)
{
    struct known *known = &adapter_known[pair];
    impromptu_report report;
    float desired[DESIRED];

    if (!known->made)
        return 1;
    EXPECT(impromptu_adapter_report(&adapters[pair].object, &report) == IMPROMPTU_STATUS_OK);
    /* A tick that is far from the trajectory is not followed for years. */
    for (unsigned sample = 0; sample < 200; sample++) {
        uint32_t next = (uint32_t)report.next_tick + sample;
        impromptu_status status;
        if ((int32_t)(next - known->tick) >= 100)
            break;
        row(next, desired);
        status = impromptu_adapter_push(&adapters[pair].object, desired, DESIRED);
        EXPECT(impromptu_adapter_push(&plain_adapters[pair].object, desired, DESIRED) == status);
        if (status == IMPROMPTU_STATUS_FULL)
            break;
        EXPECT(status == IMPROMPTU_STATUS_OK);
    }
    return 1;
}

static int adapter_push(unsigned pair, void *place)
{
    struct known *known = &adapter_known[pair];
    float desired[ROOM] = {0};
    size_t count = counted(DESIRED);
    void *numbers_at;

    numbers(desired, DESIRED, 1.0f);
    numbers_at = at(desired);
    ADAPTER_CALL(finite(desired, DESIRED) ? MAY(OK) | MAY(FULL) : MAY(NOT_FINITE), push, numbers_at, count);
    return fenced(0);
}

/* Near where the vehicle is desired to be, in most cases. */
static void measure(const struct known *known, float *measured)
{
    memset(measured, 0, ROOM * sizeof *measured);
    numbers(measured, MEASURED, 0.05f);
    for (unsigned channel = 0; channel < REFERENCE; channel++)
        measured[channel] += known->desired[channel];
}

static int adapter_begin(unsigned pair, void *place)
{
    struct known *known = &adapter_known[pair];
    impromptu_adapter *plain = &plain_adapters[pair].object;
    float measured[ROOM];
    size_t count = counted(MEASURED);
    int32_t tick = near((int32_t)known->tick);
    impromptu_job job;
    int released;
    void *numbers_at, *work = at(OUTPUT), *due = at(FLAG);

    measure(known, measured);
    numbers_at = at(measured);
    JUDGE(impromptu_adapter_begin(place, tick, numbers_at, count, work, due), IF_MADE(known->made, MAY(OK)),
          adapters[pair].object);
    EXPECT(impromptu_adapter_begin(plain, tick, measured, MEASURED, &job, &released) == IMPROMPTU_STATUS_OK && released == 0);
    memcpy(&released, FLAG, sizeof released);
    EXPECT(released == 0 || released == 1);
    if (released)
        memcpy(&known->job, OUTPUT, sizeof known->job);
    return fenced(released ? sizeof known->job : 0);
}

/* A whole reference tick, or its second part. */
static int adapter_step(unsigned pair, void *place, int whole)
{
    struct known *known = &adapter_known[pair];
    impromptu_adapter *plain = &plain_adapters[pair].object;
    impromptu_scratch *scratch = &scratches[choice(PAIRS)].object;
    float measured[ROOM], reference[REFERENCE], desired[REFERENCE];
    size_t count = counted(MEASURED), outputs = counted(REFERENCE);
    uint64_t may = MAY(NO_TRAJECTORY);
    int32_t tick;
    void *numbers_at, *memory, *result = at(OUTPUT);
    impromptu_status status, other;

    if (whole || choice(2))
        known->tick++;
    tick = near((int32_t)known->tick);
    if (choice(10) == 0)
        known->tick = (uint32_t)tick;
    measure(known, measured);
    may |= finite(measured, MEASURED) ? MAY(OK) : MAY(BAD_SAMPLE);
    numbers_at = at(measured);
    if (whole) {
        int made = known->made && scratch_made[scratch == &scratches[1].object];
        memory = object(scratch, &models[0].object);
        status = impromptu_adapter_step(place, memory, tick, numbers_at, count, result, outputs);
        JUDGE(status, IF_MADE(made, may), adapters[pair].object);
        other = impromptu_adapter_step(plain, scratch, tick, measured, MEASURED, desired, REFERENCE);
    } else {
        status = impromptu_adapter_finish(place, tick, numbers_at, count, result, outputs);
        JUDGE(status, IF_MADE(known->made, may), adapters[pair].object);
        other = impromptu_adapter_finish(plain, tick, measured, MEASURED, desired, REFERENCE);
    }
    EXPECT(other == status);
    memcpy(reference, OUTPUT, sizeof reference);
    if (usual(desired, REFERENCE))
        memcpy(known->desired, desired, sizeof known->desired);
    return reference_within(&known->corrections, reference, desired) && fenced(sizeof reference);
}

static int reported(const impromptu_report *report)
{
    EXPECT(finite(report->correction, IMPROMPTU_MAX_OUTPUTS));
    EXPECT(report->network_weight >= 0.0f && report->network_weight <= 1.0f);
    EXPECT(report->feedback_weight >= 0.0f && report->feedback_weight <= 1.0f);
    faded_in += report->network_weight == 1.0f;
    return fenced(sizeof *report);
}

static int deliver(struct known *known, impromptu_inference *inference)
{
    *inference = known->inference;
    if (choice(8) == 0)
        numbers(inference->outputs, IMPROMPTU_MAX_OUTPUTS, 1.0f);
    if (choice(8) == 0)
        inference->tick = near(inference->tick);
    return finite(inference->outputs, IMPROMPTU_MAX_OUTPUTS);
}

static int adapter_call(unsigned pair)
{
    struct known *known = &adapter_known[pair];
    impromptu_adapter *adapter = &adapters[pair].object;
    impromptu_inference inference;
    impromptu_report report;
    int32_t tick;
    void *place;

    begin(adapter, sizeof *adapter);
    place = object(adapter, &flights[0].object);
    tick = near((int32_t)known->tick);
    switch (choice(40)) {
    case 0: return adapter_push(pair, place);
    case 1: ADAPTER_CALL(MAY(OK), restart, tick); break;
    case 2: ADAPTER_CALL(MAY(OK), replan, tick); break;
    case 3: ADAPTER_CALL(MAY(OK), set_age, choice(4) ? 0 : word()); break;
    case 4: ADAPTER_CALL(MAY(OK), set_age, 0); break;
    case 5: JUDGE(impromptu_adapter_rearm(place), IF_MADE(known->made, MAY(OK)), *adapter); break;
    case 6: JUDGE(impromptu_adapter_defer(place), IF_MADE(known->made, MAY(OK)), *adapter); break;
    case 7:
        JUDGE(impromptu_adapter_switch(place, choice(4) != 0, choice(4) != 0), IF_MADE(known->made, MAY(OK)), *adapter);
        break;
    case 8:
        JUDGE(impromptu_adapter_report(place, at(OUTPUT)), IF_MADE(known->made, MAY(OK)), *adapter);
        memcpy(&report, OUTPUT, sizeof report);
        return reported(&report);
    case 9: case 10: {
        int good = deliver(known, &inference);
        void *given = at(&inference);
        ADAPTER_CALL(good ? MAY(OK) : MAY(NOT_FINITE), deliver, given);
        break;
    }
    case 11: case 12: return adapter_follow(pair);
    case 13: case 14: return adapter_begin(pair, place);
    case 15: case 16: return adapter_step(pair, place, 0);
    default: return adapter_step(pair, place, 1);
    }
    return fenced(0);
}

static const impromptu_flight_settings crazyflie = {
    0.03f, {1.4e-5f, 1.4e-5f, 2.9e-5f}, {{0.03f, 0.03f}, {0.03f, -0.03f}, {-0.03f, -0.03f}, {-0.03f, 0.03f}},
    {1, -1, 1, -1}, 2.3e-8f, 7.8e-10f, 2500.0f, {6, 6, 15}, {4, 4, 9}, {0, 0, 0}, 0.5f, 544.0f, 46.0f, 500.0f, 5};

static int flight_create(unsigned pair)
{
    impromptu_flight *flight = &flights[pair].object;
    impromptu_flight_settings settings = crazyflie;
    uint64_t may = MAY(OK);
    size_t size, number = choice(32) * sizeof(float);
    void *place, *given;

    begin(flight, sizeof *flight);
    if (choice(3) == 0) {
        float value;
        memcpy(&value, (char *)&settings + number, sizeof value);
        value = choice(2) ? value * (1.0f + within(1.0f)) : insane();
        memcpy((char *)&settings + number, &value, sizeof value);
        may = MAY(OK) | MAY(SETTINGS);
    }
    if (choice(30) == 0) {
        settings.position_divisor = word() >> choice(32);
        may = MAY(OK) | MAY(SETTINGS);
    }
    place = at(flight);
    given = at(&settings);
    size = sized(sizeof *flight, impromptu_flight_size());
    JUDGE(impromptu_flight_create(place, size, given), may, *flight);
    EXPECT(impromptu_flight_create(&plain_flights[pair].object, sizeof *flight, &settings) == IMPROMPTU_STATUS_OK);
    renew(&flight_known[pair], -1, 0, usual_caps);
    return fenced(0);
}

static int flight_attach(unsigned pair, void *place)
{
    unsigned index = choice(PAIRS);
    struct known *known = &flight_known[pair];
    void *model = object(&models[index].object, &scratches[0].object);

    JUDGE(impromptu_flight_attach(place, model, choice(8) != 0, choice(8) != 0),
          IF_MADE(known->made && model_made[index], MAY(OK) | MAY(RATE)), flights[pair].object);
    EXPECT(impromptu_flight_attach(&plain_flights[pair].object, &models[index].object, 0, 0) == IMPROMPTU_STATUS_OK);
    known->model = (int)index;
    return fenced(0);
}

static int flight_push(unsigned pair, void *place)
{
    float desired[DESIRED];
    uint64_t may;
    impromptu_setpoint setpoint;
    void *given;

    numbers(desired, DESIRED, 1.0f);
    memcpy(&setpoint, desired, sizeof setpoint);
    given = at(&setpoint);
    may = usual(desired, DESIRED) ? MAY(OK) : finite(desired, DESIRED) ? MAY(OK) | MAY(NOT_FINITE) : MAY(NOT_FINITE);
    may |= may & MAY(OK) ? MAY(FULL) : 0;
    const impromptu_status status = impromptu_flight_push(place, given);
    JUDGE(status, IF_MADE(flight_known[pair].made, may), flights[pair].object);
    EXPECT(impromptu_flight_push(&plain_flights[pair].object, &setpoint) == status);
    return fenced(0);
}

static int flight_follow(unsigned pair)
{
    impromptu_setpoint setpoint;
    float desired[DESIRED];

    for (unsigned sample = choice(60); sample > 0 && flight_known[pair].made; sample--) {
        row(flight_known[pair].tick / 5 + sample, desired);
        memcpy(&setpoint, desired, sizeof setpoint);
        const impromptu_status status = impromptu_flight_push(&flights[pair].object, &setpoint);
        EXPECT(impromptu_flight_push(&plain_flights[pair].object, &setpoint) == status);
        if (status == IMPROMPTU_STATUS_FULL)
            break;
        EXPECT(status == IMPROMPTU_STATUS_OK);
    }
    return 1;
}

/* A control tick, in one piece or with the network's work apart. */
static int flight_step(unsigned pair, void *place, int whole)
{
    struct known *known = &flight_known[pair];
    impromptu_flight *plain = &plain_flights[pair].object;
    impromptu_scratch *scratch = &scratches[choice(PAIRS)].object;
    impromptu_state state;
    impromptu_command command, other;
    float raw[sizeof state / sizeof(float)];
    int made = known->made && (!whole || scratch_made[scratch == &scratches[1].object]), released = 0;
    uint64_t may;
    uint32_t tick = choice(40) ? known->tick++ : (uint32_t)near((int32_t)known->tick);
    void *result = at(OUTPUT), *given, *memory;
    impromptu_status status;

    numbers(raw, sizeof raw / sizeof *raw, 0.05f);
    raw[6] += 1.0f;
    for (unsigned channel = 0; channel < REFERENCE; channel++)
        raw[channel] += known->desired[channel];
    memcpy(&state, raw, sizeof state);
    may = usual(raw, sizeof raw / sizeof *raw) && raw[6] > 0.5f ? MAY(OK) : MAY(OK) | MAY(NOT_FINITE);
    if (!finite(raw, sizeof raw / sizeof *raw))
        may = MAY(NOT_FINITE);
    given = at(&state);
    if (whole) {
        memory = object(scratch, &models[0].object);
        status = impromptu_flight_step(place, memory, tick, given, result);
        JUDGE(status, IF_MADE(made, may), flights[pair].object);
        EXPECT(impromptu_flight_step(plain, scratch, tick, &state, &other) == status);
    } else {
        impromptu_job job;
        void *due = at(FLAG), *work = at(&known->job);
        status = impromptu_flight_control(place, tick, given, result, work, due);
        JUDGE(status, IF_MADE(made, may), flights[pair].object);
        EXPECT(impromptu_flight_control(plain, tick, &state, &other, &job, &released) == status && released == 0);
        memcpy(&released, FLAG, sizeof released);
        EXPECT(released == 0 || released == 1);
    }
    memcpy(&command, OUTPUT, sizeof command);
    for (unsigned motor = 0; motor < 4; motor++)
        EXPECT(command.motors[motor] >= 0.0f && command.motors[motor] <= 1.0f);
    EXPECT(isfinite(command.reference.yaw) && command.reference.yaw == other.reference.yaw);
    memcpy(known->desired, &other.reference, sizeof known->desired);
    return reference_within(&known->corrections, command.reference.position, other.reference.position) && fenced(sizeof command);
}

static int flight_call(unsigned pair)
{
    struct known *known = &flight_known[pair];
    impromptu_flight *flight = &flights[pair].object;
    impromptu_inference inference;
    impromptu_report report;
    uint64_t attached = IF_MADE(known->made, known->model >= 0 ? MAY(OK) : MAY(NOTHING));
    void *place, *given;

    begin(flight, sizeof *flight);
    place = object(flight, &adapters[0].object);
    switch (choice(40)) {
    case 0: case 1: return flight_attach(pair, place);
    case 2: return flight_push(pair, place);
    case 3: case 4: return flight_follow(pair);
    case 5: JUDGE(impromptu_flight_switch(place, choice(4) != 0, choice(4) != 0), attached, *flight); break;
    case 6:
        JUDGE(impromptu_flight_report(place, at(OUTPUT)), attached, *flight);
        memcpy(&report, OUTPUT, sizeof report);
        return reported(&report);
    case 7: case 8:
        deliver(known, &inference);
        given = at(&inference);
        JUDGE(impromptu_flight_deliver(place, given), IF_MADE(known->made, MAY(OK)), *flight);
        break;
    case 9: case 10: case 11: case 12: return flight_step(pair, place, 0);
    default: return flight_step(pair, place, 1);
    }
    return fenced(0);
}

static int one_call(void)
{
    unsigned pair = choice(PAIRS);
    /* Objects are made seldom enough that lanes come in between, and often enough that few calls find none. */
    unsigned kind = choice(4000);

    if (kind < 1)
        return model_create(pair);
    if (kind < 10)
        return adapter_create(pair);
    if (kind < 20)
        return flight_create(pair);
    if (kind < 24)
        return scratch_create(pair);
    switch (choice(20)) {
    case 0: return job_run(choice(2) ? &adapter_known[pair] : &flight_known[pair]);
    case 1: return model_describe(pair);
    case 2: case 3: case 4: case 5: case 6: case 7: case 8: case 9: case 10: return adapter_call(pair);
    default: return flight_call(pair);
    }
}

#define UNHARMED(name)                                                                                       \
    (untouched(name[0].before, name[0].before + FENCE) && untouched(name[0].behind, name[0].behind + FENCE) \
     && untouched(name[1].before, name[1].before + FENCE) && untouched(name[1].behind, name[1].behind + FENCE))
#define FENCED(name)                                            \
    for (unsigned pair = 0; pair < PAIRS; pair++) {             \
        memset(name[pair].before, UNTOUCHED, FENCE);            \
        memset(name[pair].behind, UNTOUCHED, FENCE);            \
    }

static int run(void)
{
    FENCED(models);
    FENCED(scratches);
    FENCED(adapters);
    FENCED(plain_adapters);
    FENCED(flights);
    FENCED(plain_flights);
    for (unsigned pair = 0; pair < PAIRS; pair++)
        adapter_known[pair].model = flight_known[pair].model = -1;
    EXPECT(impromptu_model_size() <= sizeof(impromptu_model) && impromptu_adapter_size() <= sizeof(impromptu_adapter));
    EXPECT(impromptu_flight_size() <= sizeof(impromptu_flight));
    for (call = 0; call < CALLS; call++) {
        if (!one_call())
            return 0;
        EXPECT(impromptu_status_text((int32_t)word())[0] != 0);
        EXPECT(UNHARMED(models) && UNHARMED(scratches) && UNHARMED(adapters) && UNHARMED(flights));
        EXPECT(UNHARMED(plain_adapters) && UNHARMED(plain_flights));
    }
    return 1;
}

int main(void)
{
    FILE *model = fopen("model.bin", "rb");

    if (!model)
        return 1;
    length = fread(file, 1, sizeof file, model);
    if (fclose(model) != 0 || length == 0)
        return 1;
    memcpy(shifted_file + 1, file, length);
    memcpy(damaged_file, file, length);
    if (!run())
        return 1;
    printf("{\"seed\":%u,\"done\":%u,\"refused\":%u,\"corrected\":%u,\"faded_in\":%u}\n", (unsigned)SEED, done, refused,
           corrected, faded_in);
    return 0;
}

/*
 * Commissions, learns, keeps and recalls what `script.bin` says, and writes every number to `answers.bin`. Then calls at random: no
 * correction is beyond its limit. The same file runs on the host and on the emulated board.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "expect.h"
#include "impromptu.h"

#define AHEAD 80
#define RANDOM_CALLS 20000u

static impromptu_learner learner, other;
static impromptu_scratch scratch;
static FILE *script, *answers;

static uint32_t seed = 1;

static uint32_t draw(uint32_t below)
{
    seed = seed * 1664525u + 1013904223u;
    return (seed >> 8) % below;
}

/* Any number: mostly sane, sometimes anything. */
static float number(void)
{
    union {
        uint32_t bits;
        float value;
    } any;

    if (draw(10) != 0)
        return (float)draw(2000) * 1e-3f - 1.0f;
    any.bits = draw(1u << 24) << 8 | draw(256);
    return any.value;
}

static int refusals(const impromptu_learner_settings *good)
{
    static uint8_t kept[IMPROMPTU_KEPT];
    impromptu_learner_settings settings = *good;
    impromptu_progress progress;
    float correction = 5.0f;
    size_t length;

    EXPECT(impromptu_learner_learn(&learner) == IMPROMPTU_STATUS_NOT_CREATED);
    EXPECT(impromptu_learner_tell_other(&learner, 0.1f) == IMPROMPTU_STATUS_NOT_CREATED);
    EXPECT(impromptu_learner_create(NULL, sizeof learner, good, 0) == IMPROMPTU_STATUS_NULL);
    EXPECT(impromptu_learner_create(&learner, sizeof learner, NULL, 0) == IMPROMPTU_STATUS_NULL);
    EXPECT(impromptu_learner_create(&learner, impromptu_learner_size() - 1, good, 0) == IMPROMPTU_STATUS_MEMORY);
    settings.correction = -1.0f;
    EXPECT(impromptu_learner_create(&learner, sizeof learner, &settings, 0) == IMPROMPTU_STATUS_SETTINGS);
    settings = *good;
    settings.gain = 1.0f;
    settings.frequency = 1e9f;
    EXPECT(impromptu_learner_create(&learner, sizeof learner, &settings, 0) == IMPROMPTU_STATUS_SETTINGS);
    DO(impromptu_learner_create(&learner, sizeof learner, good, 0));
    EXPECT(impromptu_learner_create(&learner, sizeof learner, &settings, 0) == IMPROMPTU_STATUS_SETTINGS);
    EXPECT(impromptu_learner_learn(&learner) == IMPROMPTU_STATUS_UNKNOWN);
    EXPECT(impromptu_learner_hold(&learner) == IMPROMPTU_STATUS_UNKNOWN);
    EXPECT(impromptu_learner_keep(&learner, kept, sizeof kept, &length) == IMPROMPTU_STATUS_NOT_KEPT);
    EXPECT(impromptu_learner_recall(&learner, kept, sizeof kept) == IMPROMPTU_STATUS_NOT_KEPT);
    EXPECT(impromptu_learner_push(&learner, NAN) == IMPROMPTU_STATUS_NOT_FINITE);
    EXPECT(impromptu_learner_step(&learner, 0, 0.0f, NAN, 1, &correction) == IMPROMPTU_STATUS_NO_TRAJECTORY && correction == 0.0f);
    EXPECT(impromptu_learner_step(&learner, 0, 0.0f, NAN, 1, NULL) == IMPROMPTU_STATUS_NULL);
    DO(impromptu_learner_push(&learner, 0.0f));
    EXPECT(impromptu_learner_step(&learner, 1, NAN, NAN, 1, &correction) == IMPROMPTU_STATUS_BAD_SAMPLE);
    DO(impromptu_learner_commission(&learner));
    DO(impromptu_learner_step(&learner, 2, 0.0f, NAN, 0, &correction));
    DO(impromptu_learner_report(&learner, &progress));
    EXPECT(progress.problem == IMPROMPTU_LEARNER_PROBLEM_GROUNDED && progress.phase == 0 && progress.gain == 0.0f);
    DO(impromptu_scratch_create(&scratch, sizeof scratch));
    EXPECT(impromptu_learner_learn((impromptu_learner *)(void *)&scratch) == IMPROMPTU_STATUS_NOT_CREATED);
    return 0;
}

static int at_random(const impromptu_learner_settings *good)
{
    static uint8_t kept[IMPROMPTU_KEPT];
    impromptu_learner_settings settings = *good;
    impromptu_progress progress;
    size_t length;
    int32_t tick = 0;
    float correction;

    settings.gain = 1.0f;
    settings.frequency = 7.0f;
    settings.damping = 0.7f;
    DO(impromptu_learner_create(&other, sizeof other, &settings, 0));
    for (uint32_t call = 0; call < RANDOM_CALLS; call++) {
        correction = 0.0f;
        switch (draw(200)) {
        case 0: impromptu_learner_commission(&other); break;
        case 1: impromptu_learner_learn(&other); break;
        case 2: impromptu_learner_hold(&other); break;
        case 3: impromptu_learner_stop(&other); break;
        case 4: impromptu_learner_forget(&other); break;
        case 5: impromptu_learner_restart(&other, tick); break;
        case 6: impromptu_learner_keep(&other, kept, draw(IMPROMPTU_KEPT + 20), &length); break;
        case 7: impromptu_learner_recall(&other, kept, draw(IMPROMPTU_KEPT + 1)); break;
        case 8: tick = (int32_t)(draw(1u << 24) << 8); break;
        case 9: DO(impromptu_learner_report(&other, &progress)); break;
        case 10: DO(impromptu_learner_tell_other(&other, number())); break;
        default:
            impromptu_learner_push(&other, number());
            impromptu_learner_step(&other, tick++ & 0x7fffffff, number(), number(), draw(50) != 0, &correction);
        }
        EXPECT(fabsf(correction) <= good->correction);
    }
    return 0;
}

static int get(void *place, size_t size)
{
    return fread(place, 1, size, script) == size;
}

static int ticks(impromptu_learner *own, int32_t first, uint32_t count)
{
    for (uint32_t tick = 0; tick < count; tick++) {
        float numbers[3], correction;

        EXPECT(get(numbers, sizeof numbers));
        DO(impromptu_learner_push(own, numbers[0]));
        DO(impromptu_learner_step(own, first + (int32_t)tick, numbers[1], numbers[2], 1, &correction));
        fwrite(&correction, sizeof correction, 1, answers);
    }
    return 0;
}

int main(void)
{
    static uint8_t kept[IMPROMPTU_KEPT];
    impromptu_learner_settings settings;
    impromptu_progress progress;
    uint32_t counts[2];
    size_t length;

    script = fopen("script.bin", "rb");
    answers = fopen("answers.bin", "wb");
    EXPECT(script != NULL && answers != NULL && get(&settings, sizeof settings) && get(counts, sizeof counts));
    if (refusals(&settings) != 0)
        return 1;
    DO(impromptu_learner_create(&learner, sizeof learner, &settings, 0));
    DO(impromptu_learner_commission(&learner));
    for (int tick = 0; tick < AHEAD; tick++)
        DO(impromptu_learner_push(&learner, 0.0f));
    if (ticks(&learner, 0, counts[0]) != 0)
        return 1;
    DO(impromptu_learner_report(&learner, &progress));
    fwrite(&progress, sizeof progress, 1, answers);
    DO(impromptu_learner_keep(&learner, kept, sizeof kept, &length));
    EXPECT(impromptu_learner_keep(&learner, kept, length - 1, &length) == IMPROMPTU_STATUS_NOT_KEPT);
    fwrite(kept, 1, length, answers);
    /* After a power cut. */
    DO(impromptu_learner_create(&learner, sizeof learner, &settings, (int32_t)counts[0]));
    kept[40] ^= 1;
    EXPECT(impromptu_learner_recall(&learner, kept, length) == IMPROMPTU_STATUS_NOT_KEPT);
    kept[40] ^= 1;
    settings.identity++;
    DO(impromptu_learner_create(&other, sizeof other, &settings, 0));
    EXPECT(impromptu_learner_recall(&other, kept, length) == IMPROMPTU_STATUS_OTHER);
    settings.identity--;
    DO(impromptu_learner_recall(&learner, kept, length));
    DO(impromptu_learner_learn(&learner));
    for (int tick = 0; tick < AHEAD; tick++) {
        float desired;

        EXPECT(get(&desired, sizeof desired));
        DO(impromptu_learner_push(&learner, desired));
    }
    if (ticks(&learner, (int32_t)counts[0], counts[1]) != 0 || at_random(&settings) != 0)
        return 1;
    fclose(answers);
    printf("{\"learner\":%u}\n", (unsigned)impromptu_learner_size());
    return 0;
}

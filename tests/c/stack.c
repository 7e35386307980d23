/* How much stack each call needs on the microcontroller: paints the memory below the stack, calls, and looks how far the paint is gone. */
#include <stdio.h>

#include "impromptu.h"

#define PAINTED 32768u
#define PAINT 0xdeadbeefu

extern const uint8_t impromptu_model_start[];
extern const uint8_t impromptu_model_end[];

static impromptu_model model;
static impromptu_adapter adapter;
static impromptu_scratch scratch;
static impromptu_flight flight;
static impromptu_learner learner;
static uintptr_t top;

static __attribute__((noinline)) void paint(void)
{
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (uintptr_t place = top - PAINTED; place < top - 64; place += 4)
        *(volatile uint32_t *)place = PAINT;
}

static unsigned used(void)
{
    uintptr_t place = top - PAINTED;

    while (*(volatile uint32_t *)place == PAINT)
        place += 4;
    return (unsigned)(top - place);
}

#define MEASURE(name, call)                                           \
    do {                                                              \
        paint();                                                      \
        if ((call) != IMPROMPTU_STATUS_OK)                            \
            return 1;                                                 \
        printf("%s\"%s\":%u", first ? "{" : ",", name, used());       \
        first = 0;                                                    \
    } while (0)

/* From the first tick to the last: 4 s, what it waits for before, and the fit. */
static __attribute__((noinline)) impromptu_status commissioning(impromptu_learner *own, float *correction)
{
    impromptu_status status = IMPROMPTU_STATUS_OK;

    for (int tick = 201; tick < 1800; tick++)
        status = impromptu_learner_step(own, tick, 0.001f * (float)(tick % 7), 0.0f, 1, correction);
    return status;
}

int main(void)
{
    static const impromptu_flight_settings settings = {
        0.03f, {1.4e-5f, 1.4e-5f, 2.9e-5f}, {{0.03f, 0.03f}, {0.03f, -0.03f}, {-0.03f, -0.03f}, {-0.03f, 0.03f}},
        {1, -1, 1, -1}, 2.3e-8f, 7.8e-10f, 2500.0f, {6, 6, 15}, {4, 4, 9}, {0, 0, 0}, 0.5f, 544.0f, 46.0f, 500.0f, 5};
    static const impromptu_learner_settings learned = {
        100.0f, 0.0f, 0, 1.0f, 7.0f, 0.7f, 0.02f, 1.0f, 0.5f, 0.3f, 20.0f, 0.05f, 4.0f, 0};
    static float desired[10], measured[13], reference[6];
    static uint8_t kept[IMPROMPTU_KEPT];
    static impromptu_job job;
    static impromptu_inference inference;
    static impromptu_state state = {{0, 0, 1}, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}, 0};
    static impromptu_command command;
    static int due;
    size_t length = (size_t)(impromptu_model_end - impromptu_model_start);
    int first = 1;

    MEASURE("model_create", impromptu_model_create(&model, sizeof model, impromptu_model_start, length));
    MEASURE("learner_create", impromptu_learner_create(&learner, sizeof learner, &learned, 0));
    MEASURE("learner_learn", impromptu_learner_learn(&learner));
    MEASURE("learner_push", impromptu_learner_push(&learner, 0.5f));
    for (int tick = 0; tick < 200; tick++)
        impromptu_learner_step(&learner, tick, 0.0f, 0.0f, 1, reference);
    MEASURE("learner_step", impromptu_learner_step(&learner, 200, 0.0f, 0.0f, 1, reference));
    MEASURE("learner_keep", impromptu_learner_keep(&learner, kept, sizeof kept, &length));
    MEASURE("learner_recall", impromptu_learner_recall(&learner, kept, length));
    impromptu_learner_commission(&learner);
    MEASURE("commissioning", commissioning(&learner, reference));
    MEASURE("scratch_create", impromptu_scratch_create(&scratch, sizeof scratch));
    MEASURE("adapter_create", impromptu_adapter_create_quadrotor(&adapter, sizeof adapter, &model, 100.0f, 0));
    MEASURE("adapter_switch", impromptu_adapter_switch(&adapter, 1, 1));
    MEASURE("adapter_push", impromptu_adapter_push(&adapter, desired, 10));
    MEASURE("adapter_begin", impromptu_adapter_begin(&adapter, 0, measured, 13, &job, &due));
    MEASURE("job_run", impromptu_job_run(&job, &model, &scratch, &inference));
    MEASURE("adapter_deliver", impromptu_adapter_deliver(&adapter, &inference));
    MEASURE("adapter_finish", impromptu_adapter_finish(&adapter, 0, measured, 13, reference, 6));
    MEASURE("flight_create", impromptu_flight_create(&flight, sizeof flight, &settings));
    MEASURE("flight_attach", impromptu_flight_attach(&flight, &model, 1, 1));
    MEASURE("flight_control", impromptu_flight_control(&flight, 0, &state, &command, &job, &due));
    printf("}\n");
    return 0;
}

/*
 * Flies what `script.bin` says with the flight stack and with the adapter alone, each in one piece and with the network's work
 * apart, and writes every number to `answers.bin`. The same file runs on the host and on the emulated board.
 */
#include <stdio.h>
#include <string.h>

#include "expect.h"
#include "impromptu.h"

#define MODEL_LIMIT 24576

static __attribute__((aligned(16))) uint8_t bytes[MODEL_LIMIT];
static impromptu_model model;
static impromptu_scratch scratch, other_scratch;
static impromptu_flight flight, split_flight;
static impromptu_adapter adapter, split_adapter;
static FILE *script, *answers;

static int get(void *place, size_t size)
{
    return fread(place, 1, size, script) == size;
}

/* The bounds that impromptu_adapter_create_quadrotor has. */
#define POSITION {1.0f, 40.0f}
#define VELOCITY {4.0f, 160.0f}
static const impromptu_cap caps[6] = {POSITION, POSITION, POSITION, VELOCITY, VELOCITY, VELOCITY};

/* What the library must refuse, whatever it is given. */
static int refusals(uint32_t length)
{
    float numbers[17] = {0};
    int due;
    impromptu_job job;
    impromptu_report report;
    impromptu_description description;
    impromptu_inference inference;
    float reference[6];
    impromptu_channel channel = {"x", "m", "world", 0};
    impromptu_signals signals = {&channel, 1, &channel, 1, &channel, 1};
    char *misaligned = (char *)&model + 1;

    EXPECT(impromptu_model_create(NULL, sizeof model, bytes, length) == IMPROMPTU_STATUS_NULL);
    EXPECT(impromptu_model_create(&model, sizeof model, NULL, length) == IMPROMPTU_STATUS_NULL);
    EXPECT(impromptu_model_create((impromptu_model *)(void *)misaligned, sizeof model, bytes, length) == IMPROMPTU_STATUS_MISALIGNED);
    EXPECT(impromptu_model_create(&model, impromptu_model_size() - 1, bytes, length) == IMPROMPTU_STATUS_MEMORY);
    EXPECT(impromptu_model_create(&model, sizeof model, bytes, length - 1) == IMPROMPTU_STATUS_DAMAGED);
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, caps, 6) == IMPROMPTU_STATUS_NOT_CREATED);
    DO(impromptu_model_create(&model, sizeof model, bytes, length));
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 99.0f, 0, caps, 6) == IMPROMPTU_STATUS_RATE);
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, &signals, 100.0f, 0, caps, 6) == IMPROMPTU_STATUS_SIGNALS);
    signals.desired_count = 17;
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, &signals, 100.0f, 0, caps, 6) == IMPROMPTU_STATUS_COUNT);
    signals.desired_count = 1;
    channel.name = "\xff";
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, &signals, 100.0f, 0, caps, 6) == IMPROMPTU_STATUS_TEXT);
    EXPECT(impromptu_adapter_switch(&adapter, 1, 1) == IMPROMPTU_STATUS_NOT_CREATED);

    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, NULL, 6) == IMPROMPTU_STATUS_CAPS);
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, caps, 5) == IMPROMPTU_STATUS_CAPS);
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 1e30f * 1e30f, 0, caps, 6) == IMPROMPTU_STATUS_RATE);
    DO(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, caps, 6));
    /* What was there lives on after a refusal. */
    EXPECT(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 99.0f, 0, caps, 6) == IMPROMPTU_STATUS_RATE);
    DO(impromptu_adapter_report(&adapter, &report));
    EXPECT(impromptu_model_create(&model, sizeof model, bytes, length - 1) == IMPROMPTU_STATUS_DAMAGED);
    DO(impromptu_model_describe(&model, &description));
    /* Nothing was pushed: the loop holds where it is. */
    DO(impromptu_scratch_create(&scratch, sizeof scratch));
    numbers[0] = 5.0f;
    EXPECT(impromptu_adapter_step(&adapter, &scratch, 0, numbers, 13, reference, 6) == IMPROMPTU_STATUS_NO_TRAJECTORY);
    EXPECT(reference[0] == 5.0f && reference[1] == 0.0f && reference[3] == 0.0f);
    numbers[0] = 0.0f;
    DO(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, caps, 6));
    DO(impromptu_adapter_push(&adapter, numbers, 10));
    numbers[1] = 1e30f * 1e30f;
    EXPECT(impromptu_adapter_step(&adapter, &scratch, 0, numbers, 13, reference, 6) == IMPROMPTU_STATUS_BAD_SAMPLE);
    EXPECT(reference[0] == 0.0f && reference[1] == 0.0f);
    numbers[1] = 0.0f;
    memset(&inference, 0, sizeof inference);
    inference.outputs[0] = 1e30f * 1e30f;
    EXPECT(impromptu_adapter_deliver(&adapter, &inference) == IMPROMPTU_STATUS_NOT_FINITE);
    memset(&scratch, 0, sizeof scratch);
    DO(impromptu_adapter_create(&adapter, sizeof adapter, &model, NULL, 100.0f, 0, caps, 6));
    EXPECT(impromptu_adapter_push(&adapter, numbers, 9) == IMPROMPTU_STATUS_COUNT);
    EXPECT(impromptu_adapter_push(&adapter, numbers, 17) == IMPROMPTU_STATUS_COUNT);
    EXPECT(impromptu_adapter_begin(&adapter, 0, numbers, 13, NULL, &due) == IMPROMPTU_STATUS_NULL);
    EXPECT(impromptu_adapter_begin(&adapter, 0, numbers, 12, &job, &due) == IMPROMPTU_STATUS_COUNT);
    EXPECT(impromptu_adapter_finish(&adapter, 0, numbers, 13, numbers, 5) == IMPROMPTU_STATUS_COUNT);
    EXPECT(impromptu_adapter_fed_back(&adapter, numbers, 5) == IMPROMPTU_STATUS_COUNT);
    EXPECT(impromptu_adapter_fed_back(&adapter, NULL, 6) == IMPROMPTU_STATUS_NULL);
    DO(impromptu_adapter_fed_back(&adapter, numbers, 6));
    EXPECT(impromptu_adapter_step(&adapter, &scratch, 0, numbers, 13, numbers, 6) == IMPROMPTU_STATUS_NOT_CREATED);
    numbers[3] = 1e30f * 1e30f;
    EXPECT(impromptu_adapter_push(&adapter, numbers, 10) == IMPROMPTU_STATUS_NOT_FINITE);
    DO(impromptu_adapter_report(&adapter, &report));
    EXPECT(report.next_tick == 0 && report.late == 0 && report.saturations == 0);
    /* A measured channel that there is not. */
    EXPECT(impromptu_adapter_expect_noise(&adapter, 1u << 13, 1) == IMPROMPTU_STATUS_COUNT);
    DO(impromptu_adapter_expect_noise(&adapter, 7, 1));
    DO(impromptu_adapter_set_airborne(&adapter, 0));
    /* An object of another kind is none. */
    memcpy(&split_adapter, &model, sizeof(uint64_t));
    EXPECT(impromptu_adapter_report(&split_adapter, &report) == IMPROMPTU_STATUS_NOT_CREATED);
    EXPECT(strcmp(impromptu_status_text(-1), "no status of this library") == 0);
    return 0;
}

/* A trajectory along x at 1 m/s: re-planned by 2 m, then braked, it moves by no more than its limits say. */
static int other_courses(const impromptu_flight_settings *settings)
{
    impromptu_state state = {{0}, {0}, {1.0f, 0.0f, 0.0f, 0.0f}, {0}, 0.0f};
    impromptu_setpoint setpoint = {{0}, {0}, {0}, 0.0f};
    impromptu_command command;
    float last = 0.0f;
    uint32_t tick;

    DO(impromptu_flight_create(&flight, sizeof flight, settings));
    DO(impromptu_flight_set_airborne(&flight, 0));
    DO(impromptu_flight_set_airborne(&flight, 1));
    DO(impromptu_scratch_create(&scratch, sizeof scratch));
    EXPECT(impromptu_flight_rearm(&flight) == IMPROMPTU_STATUS_NOTHING);
    setpoint.velocity[0] = 1.0f;
    for (tick = 0; tick < 400; tick++) {
        if (tick < 200)
            DO(impromptu_flight_push(&flight, &setpoint));
        setpoint.position[0] += 0.01f;
        if (tick == 100) {
            EXPECT(impromptu_flight_replan(&flight, 99, &setpoint) == IMPROMPTU_STATUS_TICK);
            setpoint.position[0] += 2.0f;
            DO(impromptu_flight_replan(&flight, 101, &setpoint));
            setpoint.position[0] += 0.01f;
        }
        if (tick == 200) {
            DO(impromptu_flight_brake(&flight));
            EXPECT(impromptu_flight_push(&flight, &setpoint) == IMPROMPTU_STATUS_BRAKING);
        }
        DO(impromptu_flight_step(&flight, &scratch, tick * settings->position_divisor, &state, &command));
        /* No more than the trajectory's 1 m/s and the blend's 5 m/s together. */
        EXPECT(command.reference.position[0] - last < 0.061f && last - command.reference.position[0] < 1e-4f);
        if (tick == 150)
            EXPECT(command.reference.position[0] > last + 0.01f);
        if (tick == 399)
            EXPECT(command.reference.position[0] == last && command.reference.velocity[0] == 0.0f);
        last = command.reference.position[0];
    }
    return 0;
}

static int pieces(uint32_t tick, const float *measured, float *reference)
{
    static impromptu_inference inference;
    static int waiting;
    impromptu_job job;
    int due;

    if (waiting)
        DO(impromptu_adapter_deliver(&split_adapter, &inference));
    DO(impromptu_adapter_begin(&split_adapter, (int32_t)tick, measured, 13, &job, &due));
    DO(impromptu_adapter_finish(&split_adapter, (int32_t)tick, measured, 13, reference, 6));
    waiting = due;
    if (due)
        DO(impromptu_job_run(&job, &model, &other_scratch, &inference));
    return 0;
}

static int fly(uint32_t ticks, uint32_t divisor)
{
    impromptu_inference inference;
    int waiting = 0;

    for (uint32_t tick = 0; tick < ticks; tick++) {
        uint32_t lanes, setpoints;
        impromptu_state state;
        impromptu_command command, other;
        impromptu_job job;

        EXPECT(get(&lanes, sizeof lanes) && get(&setpoints, sizeof setpoints));
        if (lanes & 4) {
            int network = (lanes & 1) != 0, feedback = (lanes & 2) != 0;
            DO(impromptu_flight_switch(&flight, network, feedback));
            DO(impromptu_flight_switch(&split_flight, network, feedback));
            DO(impromptu_adapter_switch(&adapter, network, feedback));
            DO(impromptu_adapter_switch(&split_adapter, network, feedback));
        }
        for (; setpoints > 0; setpoints--) {
            impromptu_setpoint setpoint;
            float desired[10];
            EXPECT(sizeof setpoint == sizeof desired && get(&setpoint, sizeof setpoint));
            memcpy(desired, &setpoint, sizeof desired);
            DO(impromptu_flight_push(&flight, &setpoint));
            DO(impromptu_flight_push(&split_flight, &setpoint));
            DO(impromptu_adapter_push(&adapter, desired, 10));
            DO(impromptu_adapter_push(&split_adapter, desired, 10));
        }
        EXPECT(get(&state, sizeof state));

        DO(impromptu_flight_step(&flight, &scratch, tick, &state, &command));
        if (waiting)
            DO(impromptu_flight_deliver(&split_flight, &inference));
        DO(impromptu_flight_control(&split_flight, tick, &state, &other, &job, &waiting));
        if (waiting)
            DO(impromptu_job_run(&job, &model, &other_scratch, &inference));
        EXPECT(memcmp(&command, &other, sizeof command) == 0);
        EXPECT(fwrite(&command, sizeof command, 1, answers) == 1);

        if (tick % divisor == 0) {
            /* Any 13 numbers: only the flight stack makes angles of a quaternion. */
            float measured[13], reference[6], split[6];
            impromptu_report report;
            memcpy(measured, &state, 13 * sizeof(float));
            DO(impromptu_adapter_step(&adapter, &scratch, (int32_t)(tick / divisor), measured, 13, reference, 6));
            EXPECT(pieces(tick / divisor, measured, split) == 0);
            EXPECT(memcmp(reference, split, sizeof reference) == 0);
            DO(impromptu_adapter_report(&adapter, &report));
            EXPECT(fwrite(reference, sizeof reference, 1, answers) == 1);
            EXPECT(fwrite(&report, sizeof report, 1, answers) == 1);
        }
    }
    return 0;
}

static int run(void)
{
    uint32_t ticks, length;
    impromptu_flight_settings settings;
    impromptu_description description;
    impromptu_report report;

    EXPECT(impromptu_model_size() <= sizeof(impromptu_model));
    EXPECT(impromptu_adapter_size() <= sizeof(impromptu_adapter));
    EXPECT(impromptu_flight_size() <= sizeof(impromptu_flight));
    EXPECT(get(&ticks, sizeof ticks) && get(&length, sizeof length) && length <= sizeof bytes);
    EXPECT(get(&settings, sizeof settings) && get(bytes, length));

    EXPECT(refusals(length) == 0);
    DO(impromptu_model_describe(&model, &description));
    EXPECT(description.channels[0] == 10 && description.channels[1] == 13 && description.channels[2] == 6);
    EXPECT(description.network == 1 && description.feedback == 1 && description.past + description.future < IMPROMPTU_PREVIEW);
    DO(impromptu_scratch_create(&scratch, sizeof scratch));
    DO(impromptu_scratch_create(&other_scratch, sizeof other_scratch));
    DO(impromptu_adapter_create_quadrotor(&adapter, sizeof adapter, &model, description.reference_rate_hz, 0));
    DO(impromptu_adapter_create(&split_adapter, sizeof split_adapter, &model, NULL, description.reference_rate_hz, 0, caps, 6));
    DO(impromptu_adapter_defer(&split_adapter));
    DO(impromptu_adapter_defer(&adapter));

    settings.control_hz = -settings.control_hz;
    EXPECT(impromptu_flight_create(&flight, sizeof flight, &settings) == IMPROMPTU_STATUS_SETTINGS);
    settings.control_hz = -settings.control_hz;
    EXPECT(other_courses(&settings) == 0);
    DO(impromptu_flight_create(&flight, sizeof flight, &settings));
    DO(impromptu_flight_create(&split_flight, sizeof split_flight, &settings));
    EXPECT(impromptu_flight_switch(&flight, 1, 1) == IMPROMPTU_STATUS_NOTHING);
    DO(impromptu_flight_attach(&flight, &model, 0, 0));
    DO(impromptu_flight_attach(&split_flight, &model, 0, 0));
    EXPECT(fly(ticks, settings.position_divisor) == 0);
    DO(impromptu_flight_report(&flight, &report));
    EXPECT(report.late == 0 && report.network_weight == 1.0f);
    DO(impromptu_adapter_restart(&adapter, 7));
    DO(impromptu_adapter_report(&adapter, &report));
    EXPECT(report.next_tick == 7);
    printf("{\"model\":%u,\"adapter\":%u,\"flight\":%u}\n", (unsigned)impromptu_model_size(), (unsigned)impromptu_adapter_size(),
           (unsigned)impromptu_flight_size());
    return 0;
}

int main(void)
{
    int result = 1;

    script = fopen("script.bin", "rb");
    answers = fopen("answers.bin", "wb");
    if (script && answers)
        result = run();
    if (answers && fclose(answers) != 0)
        result = 1;
    return result;
}

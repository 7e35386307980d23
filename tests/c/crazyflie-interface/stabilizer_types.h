/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

typedef uint32_t stabilizerStep_t; /* at 1000 Hz */
typedef struct { float x, y, z; } Axis3f;
typedef struct { uint32_t timestamp; float roll, pitch, yaw; } attitude_t;
struct vec3_s { uint32_t timestamp; float x, y, z; };
typedef struct vec3_s point_t;
typedef struct vec3_s velocity_t;
typedef struct vec3_s acc_t;
typedef struct vec3_s jerk_t;
typedef struct { float x, y, z, w; } quaternion_t;
typedef struct {
  Axis3f acc;  /* Gs */
  Axis3f gyro; /* deg/s */
} sensorData_t;
typedef struct {
  attitude_t attitude; /* deg, pitch inverted */
  quaternion_t attitudeQuaternion;
  point_t position;
  velocity_t velocity;
  acc_t acc; /* Gs, without gravity */
} state_t;
typedef struct { int16_t roll, pitch, yaw; float thrust; } control_t;
typedef enum { modeDisable = 0, modeAbs, modeVelocity } stab_mode_t;
typedef struct { stab_mode_t x, y, z, roll, pitch, yaw, quat; } setpoint_mode_t;
typedef struct {
  uint32_t timestamp;
  attitude_t attitude;     /* deg */
  attitude_t attitudeRate; /* deg/s */
  quaternion_t attitudeQuaternion;
  float thrust;
  point_t position;
  velocity_t velocity;
  acc_t acceleration;
  jerk_t jerk;
  bool velocity_body;
  setpoint_mode_t mode;
} setpoint_t;
#define RATE_MAIN_LOOP 1000
#define POSITION_RATE 100
#define RATE_DO_EXECUTE(RATE_HZ, TICK) ((TICK % (RATE_MAIN_LOOP / RATE_HZ)) == 0)

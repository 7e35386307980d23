/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdint.h>
#define LOG_UINT32 3
#define LOG_FLOAT 7
struct log_s { uint8_t type; const char *name; volatile void *address; };
#define LOG_GROUP_START(NAME) static struct log_s logs_##NAME[] __attribute__((used)) = {
#define LOG_ADD(TYPE, NAME, ADDRESS) {.type = (TYPE), .name = #NAME, .address = (ADDRESS)},
#define LOG_GROUP_STOP(NAME) };

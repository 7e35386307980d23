/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdint.h>
#define PARAM_UINT8 0x08
#define PARAM_INT32 0x02
#define PARAM_FLOAT 0x06
#define PARAM_RONLY (1 << 6)
struct param_s {
  uint8_t type;
  const char *name;
  volatile void *address;
};
#define PARAM_GROUP_START(NAME) static struct param_s params_##NAME[] __attribute__((used)) = {
#define PARAM_ADD(TYPE, NAME, ADDRESS) {.type = (TYPE), .name = #NAME, .address = (ADDRESS)},
#define PARAM_GROUP_STOP(NAME) };

/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdint.h>
#define M2T(milliseconds) ((unsigned int)(milliseconds))
typedef uint32_t StackType_t;

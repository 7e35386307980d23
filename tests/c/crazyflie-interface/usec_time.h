/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdint.h>
uint64_t usecTimestamp(void);

/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#include <stdbool.h>
#include <stdint.h>
bool crtpCommanderHighLevelReadTrajectory(const uint32_t offset, const uint32_t length, uint8_t *destination);

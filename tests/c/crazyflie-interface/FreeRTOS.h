/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#define M2T(milliseconds) ((unsigned int)(milliseconds))

/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
struct vec { float x, y, z; };
static inline struct vec mkvec(float x, float y, float z) { struct vec v = {x, y, z}; return v; }

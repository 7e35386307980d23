/* The part of the Crazyflie firmware's interface that the example uses, in its documented names: enough to compile and test against. */
#pragma once
#define PP_SIZE 8
struct vec { float x, y, z; };
struct poly4d { float p[4][PP_SIZE]; float duration; };
struct traj_eval { struct vec pos, vel, acc, jerk, omega; float yaw; };
struct traj_eval poly4d_eval(struct poly4d const *p, float t);

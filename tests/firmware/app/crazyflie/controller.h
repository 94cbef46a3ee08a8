// The controller's interface, for the 1 kHz tap.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef struct {
  float axis[3];
} Axis3f;
typedef struct {
  Axis3f acc, gyro;
} sensorData_t;
typedef struct {
  int unused;
} control_t, setpoint_t, state_t;
typedef uint32_t stabilizerStep_t;

void controllerOutOfTreeInit(void);
bool controllerOutOfTreeTest(void);
void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                         const state_t *state, const stabilizerStep_t stabilizerStep);

#include "imu_tap.h"

#include <stdint.h>
#include <string.h>

#include "FreeRTOS.h"
#include "task.h"

#include "controller.h"
#include "controller_pid.h"

typedef struct {
  float acc[3];
  float gyro[3];
  uint32_t count;
} imuSum_t;

static imuSum_t sum;

void controllerOutOfTreeInit(void) { controllerPidInit(); }

bool controllerOutOfTreeTest(void) { return controllerPidTest(); }

static void note(const sensorData_t *sensors) {
  // The reader has a lower priority and copies with interrupts off: nothing to wait for here.
  for (int i = 0; i < 3; i++) {
    sum.acc[i] += sensors->acc.axis[i];
    sum.gyro[i] += sensors->gyro.axis[i];
  }
  sum.count++;
}

void controllerOutOfTree(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors,
                         const state_t *state, const stabilizerStep_t stabilizerStep) {
  controllerPid(control, setpoint, sensors, state, stabilizerStep);
  note(sensors);
}

bool imuTapRead(imuMean_t *mean) {
  taskENTER_CRITICAL();
  const imuSum_t taken = sum;
  memset(&sum, 0, sizeof sum);
  taskEXIT_CRITICAL();
  if (taken.count == 0) {
    return false;
  }
  for (int i = 0; i < 3; i++) {
    mean->acc[i] = taken.acc[i] / (float)taken.count;
    mean->gyro[i] = taken.gyro[i] / (float)taken.count;
  }
  return true;
}

// Height over a platform, built in by CONFIG=app-config-height and off until the parameter atHeight.enable is set: the
// linker lets what the firmware hands to its estimator pass here first (ld --wrap=estimatorEnqueue).
#include <math.h>

#include "FreeRTOS.h"
#include "task.h"

#include "estimator.h"
#include "log.h"
#include "param.h"
#include "supervisor.h"

#include "floor_height.h"

#define HALF_CONE 0.1308997f       // rad, of the range sensor: mm_tof.c takes so much off the tilt
#define COUNTS_PER_RADIAN 488.32f  // 10 counts a pixel, 35 pixels over 0.71674 rad: mm_flow.c
#define RADIANS_PER_DEGREE 0.01745329252f

enum { HEIGHT, CLIMB, QX, QY, RATE_X, RATE_Y, VARIABLES };
static const char *const names[VARIABLES][2] = {{"stateEstimate", "z"},  {"stateEstimate", "vz"},
                                                {"stateEstimate", "qx"}, {"stateEstimate", "qy"},
                                                {"gyro", "x"},           {"gyro", "y"}};
static logVarId_t ids[VARIABLES];
static volatile enum { NOT_SOUGHT, FOUND, LACKING } variables;  // set by either deck's task
static uint8_t enable;
static floorHeight_t state;

/**
 * Looks at the start alone: a search through the whole table. A deck's task that comes in meanwhile looks by itself.
 * @return false where a variable is lacking: everything stays as it is
 */
static bool findVariables(void) {
  if (variables == NOT_SOUGHT) {
    bool all = true;
    for (int i = 0; i < VARIABLES; i++) {
      ids[i] = logGetVarId(names[i][0], names[i][1]);
      all = all && logVarIdIsValid(ids[i]);
    }
    variables = all ? FOUND : LACKING;
  }
  return variables == FOUND;
}

/** Forgets the floor; the count of its steps stays. */
static void resetFloor(void) { state = (floorHeight_t){.steps = state.steps}; }

/** Of the angle between beam and plumb, as the estimator counts it. */
static float tiltCosine(void) {
  const float x = logGetFloat(ids[QX]), y = logGetFloat(ids[QY]);
  const float up = 1.0f - 2.0f * (x * x + y * y);
  const float angle = acosf(up < -1.0f ? -1.0f : (up > 1.0f ? 1.0f : up)) - HALF_CONE;
  return angle > 0.0f ? cosf(angle) : 1.0f;
}

static void correctRange(tofMeasurement_t *tof) {
  if (!supervisorIsFlying()) {
    resetFloor();
    return;
  }
  tof->distance = floorHeightRange(&state, tof->distance, xTaskGetTickCount(), tiltCosine(), logGetFloat(ids[CLIMB]),
                                   logGetFloat(ids[HEIGHT]));
}

static void correctFlow(flowMeasurement_t *flow) {
  const float share = floorHeightFlow(&state, logGetFloat(ids[HEIGHT]));
  const float scale = COUNTS_PER_RADIAN * RADIANS_PER_DEGREE * flow->dt;
  const float turnX = -scale * logGetFloat(ids[RATE_Y]), turnY = scale * logGetFloat(ids[RATE_X]);
  flow->dpixelx = turnX + share * (flow->dpixelx - turnX);
  flow->dpixely = turnY + share * (flow->dpixely - turnY);
}

void __real_estimatorEnqueue(const measurement_t *measurement);
void __wrap_estimatorEnqueue(const measurement_t *measurement);

void __wrap_estimatorEnqueue(const measurement_t *measurement) {
  const bool tof = measurement->type == MeasurementTypeTOF;
  if (!enable || !(tof || measurement->type == MeasurementTypeFlow) || !findVariables()) {
    if (!enable) {
      resetFloor();
    }
    __real_estimatorEnqueue(measurement);
    return;
  }
  measurement_t changed = *measurement;
  if (tof) {
    correctRange(&changed.data.tof);
  } else if (state.floor != 0.0f) {
    correctFlow(&changed.data.flow);
  }
  __real_estimatorEnqueue(&changed);
}

/**
 * Height over a platform.
 */
LOG_GROUP_START(atHeight)
/** @brief Height of what is below over where the drone took off [m] */
LOG_ADD(LOG_FLOAT, floor, &state.floor)
/** @brief Steps of the floor so far */
LOG_ADD(LOG_UINT16, steps, &state.steps)
LOG_GROUP_STOP(atHeight)

/**
 * Height over a platform.
 */
PARAM_GROUP_START(atHeight)
/** @brief 0: as the firmware ships; 1: the height is kept over a platform */
PARAM_ADD(PARAM_UINT8, enable, &enable)
PARAM_GROUP_STOP(atHeight)

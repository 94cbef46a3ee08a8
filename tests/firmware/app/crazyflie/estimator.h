// What of the estimator's interface the height over a platform uses.
#pragma once

#include <stdint.h>

typedef struct {
  float distance;
} tofMeasurement_t;
typedef struct {
  float dpixelx, dpixely, dt;
} flowMeasurement_t;
typedef enum { MeasurementTypeTOF, MeasurementTypeFlow, MeasurementTypeBarometer } MeasurementType;
typedef struct {
  MeasurementType type;
  union {
    tofMeasurement_t tof;
    flowMeasurement_t flow;
  } data;
} measurement_t;

#include "floor_height.h"

#include <math.h>

static void keepReading(floorHeight_t *state, float plumb, uint32_t ms) {
  state->range = plumb;
  state->time = ms;
  state->known = true;
}

/** The sum of steps down to nothing, where it is all but that. */
static void fadeFloor(floorHeight_t *state, float seconds) {
  const float most = FLOOR_FADE_MPS * seconds;
  if (fabsf(state->floor) > FLOOR_HOME_M) {
    return;
  }
  state->floor = fabsf(state->floor) <= most ? 0.0f : state->floor - copysignf(most, state->floor);
}

static void takeStep(floorHeight_t *state, float jump) {
  state->floor -= jump;
  state->steps++;
  if (!(fabsf(state->floor) <= FLOOR_MOST_M)) {
    state->floor = 0.0f;
  }
}

float floorHeightRange(floorHeight_t *state, float distance, uint32_t ms, float cosine, float climb, float height) {
  const bool usable = isfinite(distance) && distance >= 0.0f && isfinite(climb) && isfinite(height);
  if (!usable || !(cosine >= FLOOR_TILT_COSINE && cosine <= 1.0f)) {
    return cosine >= FLOOR_BEAM_COSINE && cosine <= 1.0f ? distance + state->floor / cosine : distance;
  }
  const float plumb = distance * cosine;
  const uint32_t since = ms - state->time;
  if (!state->known || since > FLOOR_GAP_MS) {
    if (!(fabsf(plumb + state->floor - height) <= FLOOR_TRUST_M)) {
      state->floor = 0.0f;
    }
  } else {
    const float seconds = 0.001f * (float)since;
    const float jump = plumb - state->range - climb * seconds;
    const float longer = plumb > state->range ? plumb : state->range;
    if (fabsf(jump) > FLOOR_STEP_M + FLOOR_TILT_SHARE * longer * (1.0f - cosine)) {
      takeStep(state, jump);
    }
    fadeFloor(state, seconds);
  }
  keepReading(state, plumb, ms);
  return distance + state->floor / cosine;
}

float floorHeightFlow(const floorHeight_t *state, float height) {
  if (state->floor == 0.0f || !(height > FLOOR_FLOW_NEAREST_M)) {
    return 1.0f;
  }
  const float near = height - state->floor;
  return (near > FLOOR_FLOW_NEAREST_M ? near : FLOOR_FLOW_NEAREST_M) / height;
}

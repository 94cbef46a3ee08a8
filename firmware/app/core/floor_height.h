/**
 * @file floor_height.h
 * The height over a platform. The firmware takes a shorter down range for lost height, and climbs. Here a step of the
 * floor is told from a climb: a reading that changed by more than the drone can have moved since the last one, by
 * its own vertical velocity, is the floor's, and is added to what the estimator gets. Everything in doubt is passed on
 * as the firmware would. Portable C11, no heap, no double; readings of 40 Hz.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

// Chosen in the virtual drone, never flown; host/docs/height.md has what each choice costs.
#define FLOOR_STEP_M 0.06f          ///< least step of the floor: a climb of 1 m/s makes 0.025 m between two readings
#define FLOOR_TILT_SHARE 0.5f       ///< of the range times (1 - cosine of the tilt), by which that grows
#define FLOOR_TILT_COSINE 0.87f     ///< of 30 degrees: with more tilt no step is learnt
#define FLOOR_BEAM_COSINE 0.1f      ///< of 84 degrees: with more tilt the reading is passed on as it is; round number
#define FLOOR_GAP_MS 150u           ///< six readings; after a longer gap a reading is compared with the height instead
#define FLOOR_TRUST_M 0.15f         ///< the floor is kept after a gap where the height agrees with it so closely
#define FLOOR_HOME_M 0.08f          ///< a smaller sum of steps is the first floor; the sum then fades
#define FLOOR_FADE_MPS 0.05f        ///< so fast: the height moves by 1.25 mm a reading
#define FLOOR_MOST_M 2.5f           ///< no floor is further from the first one: the sum of steps starts again
#define FLOOR_FLOW_NEAREST_M 0.08f  ///< least range of the flow sensor, PMW3901: its picture does not scale below

/** All zero at the start, and while the drone does not fly. */
typedef struct {
  float floor;     ///< m, of what is below over where it took off
  float range;     ///< m, last reading, plumb
  uint32_t time;   ///< ms, of that
  uint16_t steps;  ///< of the floor so far
  bool known;      ///< there was a reading
} floorHeight_t;

/**
 * One reading of the down range.
 * @param distance  m, along the beam
 * @param ms        its time; wraps
 * @param cosine    of the angle between beam and plumb
 * @param climb     m/s, vertical velocity of the estimator
 * @param height    m, of the estimator
 * @return what the estimator is to get, m
 */
float floorHeightRange(floorHeight_t *state, float distance, uint32_t ms, float cosine, float climb, float height);

/**
 * What multiplies the share of an optical flow that comes from moving: the estimator divides by its height, the
 * sensor by the distance to the platform.
 */
float floorHeightFlow(const floorHeight_t *state, float height);

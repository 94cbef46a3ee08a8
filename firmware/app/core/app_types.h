/**
 * @file app_types.h
 * What goes into the app's core and what comes out. Plain structs without a macro: the host reads this file as it is.
 */
#pragma once

#include <stdint.h>

/** One sample of every sensor, at 100 Hz. Values that are not known are NaN. */
typedef struct {
  float acc[3];       ///< m/s^2, gravity included: +g along z at rest
  float gyro[3];      ///< rad/s, body axes
  float pwm[4];       ///< 0..65535
  float vbat;         ///< V
  float attitude[4];  ///< unit quaternion x, y, z, w from body to world
  uint8_t accInBody;  ///< 0: acc is in world axes; 1: in body axes, and is turned by the attitude
} appSample_t;

/**
 * Settings that may change in flight; the PARAM group `airtouch`.
 * The defaults of probabilityIn, probabilityOut, probabilityDwell and alertHold are `paper`'s own values.
 * `paper-stream` takes each of them for "tuned" and uses its own value in its place (app_paper.h): it cannot be given
 * `paper`'s exact value.
 */
typedef struct {
  uint8_t enable;             ///< 0: nothing is computed, nothing is sent
  uint8_t detector;           ///< appDetector_t
  uint8_t filter;             ///< appFilter_t
  float bandMid;              ///< Hz, FC-FE: middle of the band
  float bandWidth;            ///< Hz, both edges included
  float pFa;                  ///< FR-CFAR: probability of false alarm
  float probabilityIn;        ///< `paper`: over a platform from here up; its default means tuned
  float probabilityOut;       ///< `paper`: off it from here down; its default means tuned
  float scoreIn;              ///< `best`: an entry fires above this logit
  float scoreOut;             ///< `best`: an exit fires above this logit
  uint16_t probabilityDwell;  ///< `paper`: at least so many steps between two edges; its default means tuned
  uint16_t alertHold;  ///< filter: an FR-CFAR alert vouches for the edges of so many steps; its default means tuned
} appParams_t;

/** What the app says; the LOG group `airtouch`. */
typedef struct {
  float feature[3];      ///< fused features: acceleration, rate, motors
  float force[3];        ///< f_w, N, level axes: world turned by the yaw
  float cfarPower;       ///< FR-CFAR: the cell under test, N^2
  float threshold;       ///< FR-CFAR: its threshold, N^2; NaN until known
  float probability;     ///< P(over a platform); NaN until known
  float logit[3];        ///< `best`: over, entry, exit
  uint32_t samples;      ///< steps so far; stands still where the app does
  uint32_t edgeSample;   ///< the step at which the last edge was reported
  uint32_t nonFinite;    ///< values that were not finite and were replaced, so far
  uint32_t dropped;      ///< packets that the CPX queue did not take, so far
  uint32_t lost;         ///< samples that never reached the GAP8, so far
  uint32_t timeouts;     ///< times that the GAP8 did not answer in time
  uint32_t gap8Resets;   ///< resets of the GAP8 that were noticed
  uint32_t gap8Uptime;   ///< ms, of its last heartbeat
  uint32_t answers;      ///< outputs of the network used so far
  uint16_t edges;        ///< edges reported so far
  uint16_t paramErrors;  ///< settings that were out of range and were put right, so far
  uint16_t late;         ///< steps that began late, so far
  uint16_t health;       ///< flags of appHealth_t
  uint16_t load;         ///< microseconds of the last step
  uint16_t loadMax;      ///< of the longest step
  uint16_t lag;          ///< samples between the newest one and the last answer of the GAP8
  uint8_t edge;          ///< the last edge: 0 none yet, 1 entry, 2 exit, 3 of unknown kind
  uint8_t alert;         ///< the cell exceeds its threshold
  uint8_t over;          ///< over a platform, as far as the last edge of this flight says; 0 on the ground
  uint8_t detector;      ///< the detector in force, which is another than the wanted one without a GAP8
  uint8_t link;          ///< linkState_t
} appLog_t;

/**
 * @file kernel_types.h
 * The plain structs that cross the border between kernels and their callers.
 * No macro is used in them: the host reads this file as it is.
 *
 * Target: C11 and C++, any processor.
 * Threads: plain values.
 * Memory: no pointers; the largest is 92 bytes.
 * Cost: none.
 */
#pragma once

#include <stdint.h>

enum {
  MOTION_CHANNELS = 12,    ///< what the streaming detector sees of a sample (motion_channels.h); the last one is empty
  EDGE_DECODER_LOGITS = 3  ///< what the decoder reads of a step (edge_decoder.h): over, entry, exit
};

/** Where the last finite values of a sample lie in an array of them: acceleration, rate, motors. */
enum { HELD_ACC = 0, HELD_GYRO = 3, HELD_PWM = 6, HELD_VALUES = 10 };

/** What the disturbance force needs to know of a vehicle; SI units, PWM 0..65535. */
typedef struct {
  float mass;            ///< kg
  float gravity;         ///< m/s^2
  float thrust[3];       ///< c0, c1, c2: newtons a motor, c0 + c1 p + c2 p^2 for p > 0, else 0
  float nominalVoltage;  ///< V at which the thrust curve holds; 0 where unknown
} airtouchVehicle_t;

/**
 * Settings of the edge pipeline, which edgePipelineDefaults() fills in. The settings of the paper's section 7.1 where
 * it gives one (rate, window, band, P_FA, cells); the project's own where marked.
 */
typedef struct {
  float sampleRateHz;
  float lowHz;  ///< band, both edges included
  float highHz;
  float pFa;               ///< FR-CFAR: probability of false alarm
  float forceMeanSamples;  ///< project: time constant of f_w,z's mean, samples
  float armPwm;            ///< project: airborne while the mean PWM is above this
  float probabilityEntry;  ///< project: over the platform from here up
  float probabilityExit;   ///< project: off it from here down
  uint16_t window;         ///< band power: samples
  uint16_t hop;            ///< band power: samples between two outputs
  uint16_t leadingWindow;  ///< FR-CFAR: cells
  uint16_t guardCells;     ///< FR-CFAR: cells
  uint16_t alertHold;      ///< project: an alert vouches for edges this many samples after it
  uint16_t armSamples;     ///< project: airborne for so long before an edge is reported
  uint16_t dwellSamples;   ///< project: at least so long between two edges
  uint8_t cfarNorm;        ///< 0, project: squared deviation of f_w,z from its mean; 1: ||f_w||
  uint8_t physicalFilter;  ///< 1: edges without a recent alert are dropped
  airtouchVehicle_t vehicle;
} edgePipelineConfig_t;

/** One sample of every sensor. */
typedef struct {
  float acc[3];         ///< m/s^2, gravity included (+g along z at rest), in world axes, or level axes where the caller
                        ///< turns yaw off (the app does)
  float gyro[3];        ///< rad/s
  float pwm[4];         ///< 0..65535
  float vbat;           ///< V, NaN for none
  float thrustAxis[3];  ///< R e_z in the axes of acc; NaN holds the last one, at first (0, 0, 1)
  float probability;    ///< the network's latest P(over a platform), NaN for none
} edgeSample_t;

/** What the pipeline found at one sample. */
typedef struct {
  float bandPower[9];   ///< the last band powers, NaN before the first
  float features[3];    ///< their fusion: acceleration, rate, motors
  float force[3];       ///< f_w, N, in the axes of acc: world, or level axes where the caller turns yaw off
  float forceNorm;      ///< ||f_w||, N
  float cfarPower;      ///< the cell under test
  float threshold;      ///< its threshold, NaN until known
  uint32_t nonFinite;   ///< values of acc, gyro and PWM replaced so far, up to 10 a sample
  uint8_t ready;        ///< band power and features are new
  uint8_t alert;        ///< the cell exceeds its threshold
  uint8_t alertRecent;  ///< there was an alert within the last alertHold samples
  uint8_t edge;         ///< 0 none, 1 entry, 2 exit
  uint8_t filtered;     ///< an edge was dropped for want of a recent alert
  uint8_t armed;        ///< airborne long enough
} edgeEvent_t;

/** Settings of the motion channels (motion_channels.h). */
typedef struct {
  airtouchVehicle_t vehicle;
  float inverseScale[MOTION_CHANNELS - 1];  ///< 1 over each channel's nominal amplitude
  float limit;                              ///< channels are clamped to this magnitude, in nominal amplitudes
  float armPwm;                             ///< airborne while the mean PWM is above this
  float slowGain;                           ///< of the slow means, a sample
  float lagGain;                            ///< of the thrust's lag, a sample
  float leastThrust;                        ///< N; the mean thrust is never taken to be less
  uint32_t settleSamples;                   ///< after take-off the slow means follow at once for so long
} motionConfig_t;

/** Settings of the streaming detector's decoder (edge_decoder.h); scores are logits. */
typedef struct {
  float overShare;      ///< weight of the over logit beside the event's own
  float entryScore;     ///< an entry fires above this
  float exitScore;      ///< an exit fires above this
  float lateEntry;      ///< smoothed over logit that makes a missed entry good
  float lateExit;       ///< and a missed exit, below this
  float smoothGain;     ///< of that smoothing, a step
  uint32_t dwellSteps;  ///< at least so long between two edges
  uint32_t armSteps;    ///< airborne for so long before the first
  uint32_t lookBack;    ///< the crossing is where the event's logit peaked in so many steps before, at most 63
  uint32_t holdSteps;   ///< an edge is reported so long after its crossing; 0: as soon as it is seen
} decoderConfig_t;

/** How the streaming detector's network takes and gives numbers. */
typedef struct {
  float inputScale;   ///< q = floor(x / inputScale + 0.5) + inputZeroPoint
  float outputScale;  ///< logit = outputScale * (q - outputZeroPoint)
  int32_t inputZeroPoint;
  int32_t outputZeroPoint;
} streamQuantisation_t;

/** What the streaming detector says at one sample. */
typedef struct {
  float logits[EDGE_DECODER_LOGITS];  ///< over, entry, exit: the last ones computed
  uint8_t ready;                      ///< they are new
  uint8_t edge;                       ///< 0 none, 1 entry, 2 exit
  uint8_t airborne;                   ///< whether the drone flies
} streamEvent_t;

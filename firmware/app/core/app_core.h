/**
 * @file app_core.h
 * Everything that the STM32 app does, without an operating system: a sample in, kernels,
 * link to the GAP8, decision, log values out. The firmware and the virtual Crazyflie both call
 * it, each with its own sensors and its own transport.
 *
 * One step every 10 ms: appCoreReceive() for each packet that came, appCoreStep(), then the packets
 * of appCoreOutgoing(). Nothing waits, nothing fails: a value that is not finite is replaced and
 * counted, a GAP8 that is silent leaves the probability unknown, and the log says so. About 20 kB.
 */
#pragma once

#include "app_local.h"
#include "app_types.h"
#include "edge_pipeline.h"
#include "link_sender.h"
#include "stream_detector.h"

#include "airtouch_stream.h"

#define APP_PACKETS 2  ///< a step, at most: the CPX queue is two deep
#define APP_EVENTS 4   ///< kinds of single events: appEvent_t
// No source for these three: round numbers.
#define APP_RECENT_STEPS 100  ///< health flags of single events stay up for so long
#define APP_ANSWER_STEPS 50   ///< an answer of the GAP8 that is older says nothing of now
#define APP_STILL_STEPS 100   ///< of flight without a change of the horizontal acceleration, until that is a fault

/** appParams_t.detector. */
typedef enum {
  APP_CFAR = 0,               ///< FR-CFAR alone, on the STM32: edges of unknown kind
  APP_BEST = 1,               ///< the streaming network, on the STM32
  APP_BEST_GAP8 = 2,          ///< the same network on the GAP8; on the STM32 while that is silent
  APP_PAPER_GAP8 = 3,         ///< the paper's network on the GAP8
  APP_PAPER_STREAM_GAP8 = 4,  ///< the same as a stream, on the GAP8
} appDetector_t;

/** appParams_t.filter: whether edges without a recent FR-CFAR alert are dropped. */
typedef enum {
  APP_FILTER_OFF = 0,
  APP_FILTER_ON = 1,
  APP_FILTER_AS_TRAINED = 2,  ///< for `paper` and `paper-stream`, not for `best`
} appFilter_t;

/** appLog_t.health; 0 is good. */
typedef enum {
  APP_NON_FINITE = 1,      ///< a value was not finite within the last second
  APP_LINK_DOWN = 2,       ///< the GAP8 does not answer
  APP_LINK_FILLING = 4,    ///< it does, but has not seen a whole window yet
  APP_MODEL_REFUSED = 8,   ///< it has another model
  APP_PARAM_CLAMPED = 16,  ///< a setting was out of range within the last second
  APP_NO_GAP8 = 32,        ///< no AI-deck, or it is silent: another detector runs than the wanted one
  APP_DROPPED = 64,        ///< the CPX queue was full within the last second
  APP_LATE = 128,          ///< a step began late within the last second
  APP_STALLED = 256,       ///< no step for 50 ms (set by whoever reads the log)
  APP_NO_SENSOR = 512,     ///< the firmware lacks a log variable that the app needs
  APP_NO_HORIZONTAL =
      1024,  ///< horizontal acceleration stood still for a second of flight: another estimator is needed
  APP_OTHER_VEHICLE = 2048,  ///< FR-CFAR runs alone: the networks were trained for another vehicle, or that of
                             ///< `best` as exported has shapes or a size that the app does not take
} appHealth_t;

/** The app. It points into itself: initialise it where it stays, never copy it. */
typedef struct {
  appParams_t params;
  appLog_t log;
  uint8_t detector;  ///< an appDetector_t: the wanted one, or what it falls back to without an AI-deck
  bool haveGap8;
  airtouchVehicle_t vehicle;
  float armPwm;
  bool networksFit;  ///< the networks were trained for such a vehicle
  uint32_t nonce;
  uint16_t since[APP_EVENTS];  ///< steps since the last event of each kind
  uint16_t sinceEdge;          ///< FR-CFAR alone: steps since its last edge
  uint16_t still;              ///< steps of flight in which the horizontal acceleration has not changed
  float horizontal[2];         ///< the last one, world axes, m/s^2
  bool wasAlert;
  bool noSensor;
  bool reported;                                    ///< an edge, since the last step
  uint32_t nonFinite;                               ///< the pipeline's count
  float probability;                                ///< the paper's network's last one, NaN while it is silent
  uint32_t airborneBits[(LINK_HISTORY + 31) / 32];  ///< whether the drone flew, sample by sample
  edgePipeline_t pipeline;
  streamDetector_t best;
  linkSender_t link;
  appLocal_t local;
  _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
} appCore_t;

/** Settings as shipped. */
void appParamsDefaults(appParams_t *params);

/**
 * Puts settings that are out of range right: each to its nearest limit, what is not finite to its default.
 * Each is limited on its own, so the order of two changes does not matter. The exit of `paper` is used at most 0.01
 * below its entry, whatever probabilityOut says.
 * @return how many were changed
 */
uint16_t appParamsClamp(appParams_t *params);

/** Whether every setting is the same, to the bit: a NaN is the same as itself; bytes between fields do not count. */
bool appParamsSame(const appParams_t *one, const appParams_t *other);

/**
 * Sets the app up.
 * @param params    NULL for those shipped; put right where they are out of range
 * @param haveGap8  whether there is an AI-deck; without one the detectors of the GAP8 fall back to
 *                  the same one on the STM32 (`best`) or to FR-CFAR alone (`paper`)
 * @param nonce     very likely differs from start to start of the processor, as its clock in us does
 */
void appCoreInit(appCore_t *core, const appParams_t *params, bool haveGap8, uint32_t nonce);

/**
 * The vehicle that flies, where it is not the one that the networks were trained for: call it after appCoreInit().
 * The networks run where thrust curve, gravity and armPwm are those of their training; the mass they do not see.
 * Elsewhere FR-CFAR runs alone, and health says so.
 * @param armPwm  airborne while the mean PWM is above this
 */
void appCoreSetVehicle(appCore_t *core, const airtouchVehicle_t *vehicle, float armPwm);

/**
 * Changes settings between two steps. What uses a setting begins anew, nothing else: another band the band power
 * (features are unknown for 2 s, about 0.5 ms) and the stream of `paper`; another detector, or enable
 * changed, all of it; another false-alarm probability is in force at once. The counters stay.
 * @param params  receives what is in force
 * @return how many were out of range and put right
 */
uint16_t appCoreSetParams(appCore_t *core, appParams_t *params);

/**
 * One step.
 * @return whether an edge is reported now: appLog_t.edge says which kind, edges counts it
 */
bool appCoreStep(appCore_t *core, const appSample_t *sample);

/** Takes a CPX packet of function APP from the GAP8: any bytes of any length. */
void appCoreReceive(appCore_t *core, const uint8_t *bytes, uint16_t length);

/**
 * The next packet for the GAP8; call it up to APP_PACKETS times a step, and appCoreSent() after each.
 * @param bytes  EDGE_LINK_MAX_BYTES of room
 * @return its length, 0 for none
 */
uint16_t appCoreOutgoing(appCore_t *core, uint8_t *bytes);

/** Whether the transport took the last packet. */
void appCoreSent(appCore_t *core, bool taken);

/** How long the last step took, in microseconds, and whether it began late. */
void appCoreTime(appCore_t *core, uint32_t microseconds, bool late);

/** The firmware lacks a log variable that the app needs. */
void appCoreNoSensor(appCore_t *core);

/**
 * Whether the last step ended more than @p limit ticks before @p now. Ticks wrap. A step that ended after
 * @p now was read is new: read the clock first, then the step's time.
 */
bool appStalled(uint32_t now, uint32_t lastStep, uint32_t limit);

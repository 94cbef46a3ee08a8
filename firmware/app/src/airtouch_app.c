// The app in the firmware: a 100 Hz task around app_core.h. It reads log variables and writes its own; it never
// calls into the stabiliser, never waits for a packet, and allocates nothing.
#include "FreeRTOS.h"
#include "task.h"

#include "app.h"
#include "autoconf.h"
#include "log.h"
#include "param.h"
#include "usec_time.h"

#define DEBUG_MODULE "AIRTOUCH"
#include "debug.h"

#include "airtouch_vehicle.h"
#include "app_core.h"
#include "app_defaults.h"
#include "app_sensors.h"
#include "gap8_port.h"

#define PERIOD M2T(10)
#define STALLED M2T(50)
#define GIVE_UP M2T(100)  // so late that the missed steps are left out

static appCore_t core;
// The PARAM group; compared with what is in force before each step.
static appParams_t wantedParams = APP_PARAMS_DEFAULTS;
static volatile TickType_t lastStep;

/** Takes changed parameters over; those out of range are written back as they were put right. */
static void takeParams(void) {
  const appParams_t asked = wantedParams;
  if (appParamsSame(&asked, &core.params)) {
    return;
  }
  appParams_t inForce = asked;
  if (appCoreSetParams(&core, &inForce) == 0) {
    return;
  }
  DEBUG_PRINT("Parameter out of range, put right\n");
  taskENTER_CRITICAL();
  if (appParamsSame(&wantedParams, &asked)) {
    wantedParams = inForce;
  }
  taskEXIT_CRITICAL();
}

static void runStep(bool late) {
  static appSample_t sample;
  const uint64_t start = usecTimestamp();
  takeParams();
  gap8PortReceive(&core);
  appSensorsRead(&sample);
  if (appCoreStep(&core, &sample)) {
    DEBUG_PRINT("Edge %u\n", core.log.edge);
  }
  gap8PortSend(&core);
  appCoreTime(&core, (uint32_t)(usecTimestamp() - start), late);
}

static void startApp(void) {
  const bool gap8 = gap8PortPresent();
  appCoreInit(&core, NULL, gap8, (uint32_t)usecTimestamp());  // no two starts are likely to take the same time
  appCoreSetVehicle(&core, &airtouchVehicle, AIRTOUCH_VEHICLE_ARM_PWM);
  if (!appSensorsInit()) {
    appCoreNoSensor(&core);
    DEBUG_PRINT("A log variable is missing: it reads as NaN\n");
  }
  DEBUG_PRINT(AIRTOUCH_VEHICLE_NAME ", %s GAP8, detector %u\n", gap8 ? "with a" : "no", core.log.detector);
}

void appMain(void) {
  startApp();
  TickType_t due = xTaskGetTickCount();
  while (1) {
    vTaskDelayUntil(&due, PERIOD);
    const TickType_t now = xTaskGetTickCount();
    const TickType_t behind = now - due;
    if (behind > GIVE_UP) {
      due = now;
    }
    runStep(behind >= PERIOD);
    lastStep = xTaskGetTickCount();
  }
}

/** The health flags as of now: a step that does not come is noticed by who asks. */
static uint16_t healthNow(uint32_t timestamp, void *data) {
  (void)timestamp;
  (void)data;
  const TickType_t now = xTaskGetTickCount();  // first: a step may end between the two
  return (uint16_t)(core.log.health | (appStalled(now, lastStep, STALLED) ? APP_STALLED : 0));
}

static logByFunction_t healthLogger = {.acquireUInt16 = healthNow};

/**
 * What AirTouch feels: edges below the drone, and how well it runs.
 */
LOG_GROUP_START(airtouch)
/** @brief Fused feature of the accelerations, (m/s^2)^3 */
LOG_ADD(LOG_FLOAT, fAcc, &core.log.feature[0])
/** @brief Fused feature of the angular rates, (rad/s)^3 */
LOG_ADD(LOG_FLOAT, fGyro, &core.log.feature[1])
/** @brief Fused feature of the motors, PWM^3 */
LOG_ADD(LOG_FLOAT, fMotor, &core.log.feature[2])
/** @brief Disturbance force f_w, level x axis [N] */
LOG_ADD(LOG_FLOAT, fwx, &core.log.force[0])
/** @brief Disturbance force f_w, level y axis [N] */
LOG_ADD(LOG_FLOAT, fwy, &core.log.force[1])
/** @brief Disturbance force f_w, upwards [N] */
LOG_ADD(LOG_FLOAT, fwz, &core.log.force[2])
/** @brief FR-CFAR: the cell under test [N^2] */
LOG_ADD(LOG_FLOAT, cell, &core.log.cfarPower)
/** @brief FR-CFAR: its threshold [N^2], NaN until known */
LOG_ADD(LOG_FLOAT, thresh, &core.log.threshold)
/** @brief FR-CFAR: the cell exceeds its threshold */
LOG_ADD(LOG_UINT8, alert, &core.log.alert)
/** @brief P(over a platform), NaN while unknown */
LOG_ADD(LOG_FLOAT, prob, &core.log.probability)
/** @brief `best`: logit of being over a platform */
LOG_ADD(LOG_FLOAT, lOver, &core.log.logit[0])
/** @brief `best`: logit of an entry */
LOG_ADD(LOG_FLOAT, lEntry, &core.log.logit[1])
/** @brief `best`: logit of an exit */
LOG_ADD(LOG_FLOAT, lExit, &core.log.logit[2])
/** @brief Edges reported so far */
LOG_ADD(LOG_UINT16, edges, &core.log.edges)
/** @brief The last edge: 0 none, 1 entry, 2 exit, 3 of unknown kind */
LOG_ADD(LOG_UINT8, edge, &core.log.edge)
/** @brief The step at which it was reported */
LOG_ADD(LOG_UINT32, edgeStep, &core.log.edgeSample)
/** @brief Over a platform, as the last edge of this flight says; 0 on the ground */
LOG_ADD(LOG_UINT8, over, &core.log.over)
/** @brief Steps of 10 ms so far; stands still where the app does */
LOG_ADD(LOG_UINT32, steps, &core.log.samples)
/** @brief 0 is good; bits: app_core.h, appHealth_t */
LOG_ADD_BY_FUNCTION(LOG_UINT16, health, &healthLogger)
/** @brief Time of the last step [us] */
LOG_ADD(LOG_UINT16, load, &core.log.load)
/** @brief Time of the longest step so far [us] */
LOG_ADD(LOG_UINT16, loadMax, &core.log.loadMax)
/** @brief Steps that began late */
LOG_ADD(LOG_UINT16, late, &core.log.late)
/** @brief The detector in force: 0 FR-CFAR, 1 best; on the GAP8: 2 best, 3 paper, 4 paper-stream */
LOG_ADD(LOG_UINT8, detector, &core.log.detector)
/** @brief Link to the GAP8: 0 starting, 1 filling, 2 up, 3 down, 4 refused */
LOG_ADD(LOG_UINT8, link, &core.log.link)
/** @brief Samples that the last answer of the GAP8 lagged */
LOG_ADD(LOG_UINT16, lag, &core.log.lag)
/** @brief Outputs of the network so far */
LOG_ADD(LOG_UINT32, answers, &core.log.answers)
/** @brief Packets that the CPX queue did not take */
LOG_ADD(LOG_UINT32, dropped, &core.log.dropped)
/** @brief Samples that never reached the GAP8 */
LOG_ADD(LOG_UINT32, lost, &core.log.lost)
/** @brief Times that the GAP8 did not answer in time */
LOG_ADD(LOG_UINT32, timeouts, &core.log.timeouts)
/** @brief Resets of the GAP8 that were noticed */
LOG_ADD(LOG_UINT32, resets, &core.log.gap8Resets)
/** @brief The GAP8's time since its start, of its last heartbeat [ms] */
LOG_ADD(LOG_UINT32, gap8Up, &core.log.gap8Uptime)
/** @brief Values that were not finite and were replaced */
LOG_ADD(LOG_UINT32, nonFin, &core.log.nonFinite)
/** @brief Parameters that were out of range and were put right */
LOG_ADD(LOG_UINT16, badParam, &core.log.paramErrors)
LOG_GROUP_STOP(airtouch)

/**
 * Settings of AirTouch. What is out of range is put right within 10 ms, and counted in airtouch.badParam.
 */
PARAM_GROUP_START(airtouch)
/** @brief 0: nothing is computed, nothing is sent */
PARAM_ADD(PARAM_UINT8, enable, &wantedParams.enable)
/** @brief 0 FR-CFAR, 1 best; on the GAP8: 2 best, 3 paper, 4 paper-stream */
PARAM_ADD(PARAM_UINT8, detector, &wantedParams.detector)
/** @brief Edges need an FR-CFAR alert: 0 never, 1 always, 2 as the detector was trained */
PARAM_ADD(PARAM_UINT8, filter, &wantedParams.filter)
/** @brief FC-FE: middle of the band, 2 to 48 [Hz] */
PARAM_ADD(PARAM_FLOAT, bandMid, &wantedParams.bandMid)
/** @brief FC-FE: width of the band, 0.6 to 2 [Hz] */
PARAM_ADD(PARAM_FLOAT, bandWidth, &wantedParams.bandWidth)
/** @brief FR-CFAR: probability of false alarm, 1e-12 to 0.5 */
PARAM_ADD(PARAM_FLOAT, pFa, &wantedParams.pFa)
/** @brief paper: over a platform from this probability up; 0.9 in paper-stream means its own */
PARAM_ADD(PARAM_FLOAT, probIn, &wantedParams.probabilityIn)
/** @brief paper: off it from this probability down; 0.2 in paper-stream means its own */
PARAM_ADD(PARAM_FLOAT, probOut, &wantedParams.probabilityOut)
/** @brief best: an entry fires above this logit */
PARAM_ADD(PARAM_FLOAT, scoreIn, &wantedParams.scoreIn)
/** @brief best: an exit fires above this logit */
PARAM_ADD(PARAM_FLOAT, scoreOut, &wantedParams.scoreOut)
/** @brief paper: at least so long between two edges, 10 to 1000; 150 in paper-stream means its own [10 ms] */
PARAM_ADD(PARAM_UINT16, probDwell, &wantedParams.probabilityDwell)
/** @brief filter: an FR-CFAR alert vouches for edges so long, 1 to 1000; 100 in paper-stream means its own [10 ms] */
PARAM_ADD(PARAM_UINT16, alertHold, &wantedParams.alertHold)
PARAM_GROUP_STOP(airtouch)

// The app's shell over stand-ins of the firmware (crazyflie/, firmware_stand_ins.h); built with sanitizers by
// test_shell.py. One scenario a run, named on the command line. The drone hovers; time is what the scenario makes of
// it.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "airtouch_app.c"
#include "firmware_stand_ins.h"

static void silent(void) {
  fly(600);
  check(core.log.detector == APP_BEST && core.log.answers > 0 && core.log.health == 0, "best runs on the STM32");
  check(sent == 0 && registered == 0, "unless it is asked to, the app has nothing to do with CPX");
}

#ifdef CONFIG_DECK_AI
static int sentBefore;

static void chooseGap8(int step) {
  wantedParams.detector = step >= 100 && step < 700 ? APP_BEST_GAP8 : APP_BEST;
  check(step > 100 || (sent == 0 && registered == 0), "nothing is sent before it is asked for");
  if (step == 700) {
    check(registered == 1 && sent > 500, "the GAP8 gets the samples");
    check(core.log.link == LINK_UP && core.log.detector == APP_BEST_GAP8 && core.log.health == 0, "and answers");
    sentBefore = sent;
  }
}

static void gap8OnRequest(void) {
  between = chooseGap8;
  fly(800);
  check(sentBefore > 0 && sent == sentBefore && core.log.detector == APP_BEST, "and is left alone again");
}

static void wantGap8(int step) {
  (void)step;
  wantedParams.detector = APP_BEST_GAP8;
}

static void noDeck(void) {
  between = wantGap8;
  fly(100);
  check(sent == 0 && registered == 0 && core.log.detector == APP_BEST, "without an AI-deck the STM32 runs the network");
  check(core.log.health == APP_NO_GAP8, "and health says so");
}

static void foreignPackets(int step) {
  uint8_t bytes[CPX_MAX_PAYLOAD_SIZE];
  wantedParams.detector = APP_BEST_GAP8;
  for (int i = 0; handler != NULL && step < 400 && i < 6; i++) {  // more than the inbox holds
    for (unsigned k = 0; k < sizeof bytes; k++) {
      bytes[k] = (uint8_t)(step * 31 + i * 7 + (int)k);
    }
    answer(i % 2 ? CPX_T_GAP8 : CPX_T_WIFI_HOST, bytes, (uint16_t)(i == 3 ? 65535 : (step * 13 + i) % 101));
  }
}

static void foreign(void) {
  between = foreignPackets;
  fly(800);
  check(core.log.link == LINK_UP && core.log.answers > 0, "the link comes up after any packets");
}
#endif

static void missingVariable(void) {
  hidden = "stateEstimate.ax";
  fly(100);
  check(core.log.health & APP_NO_SENSOR, "health says that a log variable is missing");
  hidden = "pm.vbat";
  fly(100);
  check(core.log.health & APP_NO_SENSOR, "health says that a log variable is missing");
}

static void badParameter(int step) {
  if (step == 50) {
    wantedParams.pFa = NAN;
    wantedParams.detector = 200;
  }
}

static void parameters(void) {
  const float usual = wantedParams.pFa;
  appParams_t most = APP_PARAMS_DEFAULTS;
  most.detector = 200;
  check(appParamsClamp(&most) == 1 && most.detector >= APP_PAPER_GAP8, "no detector has that number");
  wantedParams.scoreIn = 4.5f;  // before the app starts
  between = badParameter;
  fly(200);
  check(wantedParams.scoreIn == 4.5f && core.params.scoreIn == 4.5f, "a parameter set before the start is kept");
  check(wantedParams.pFa == usual && wantedParams.detector == most.detector, "what is out of range is put right");
  check(core.log.paramErrors == 2, "and counted once");
}

static void setAnother(void) { wantedParams.scoreOut = 3.25f; }

static void writeBetween(void) {
  wantedParams.pFa = -1.0f;
  beforeCritical = setAnother;
  fly(1);
  check(wantedParams.scoreOut == 3.25f, "a parameter written while another is put right is not lost");
  fly(1);
  check(wantedParams.scoreOut == 3.25f && wantedParams.pFa == 1e-12f && core.params.scoreOut == 3.25f,
        "and is in force next");
}

static void finishStep(void) { lastStep = ++tick; }

static bool stalledNow(void) { return (healthLogger.acquireUInt16(0, NULL) & APP_STALLED) != 0; }

static void stalled(void) {
  check(stalledNow(), "before the first step nothing runs");
  fly(20);
  check(!stalledNow(), "it runs");
  afterClock = finishStep;
  check(!stalledNow(), "a step that ends while health is read is none that does not come");
  tick += 51;
  check(stalledNow(), "no step for more than 50 ms");
  tick = UINT32_MAX - 20;
  fly(20);
  check(!stalledNow() && core.log.samples == 20, "ticks wrap");
}

static void hold(int step) { delay = step == 100 ? 40 : (step == 150 ? 500 : 0); }

static void late(void) {
  between = hold;
  const TickType_t begin = tick;
  fly(200);
  check(core.log.late >= 4 && core.log.late <= 6, "steps that begin late are counted");
  check(core.log.samples == 200 && tick - begin >= 2000 + 500 - 20, "what is missed by far is left out");
}

#ifdef CONFIG_CONTROLLER_OOT
#include "controller_pid.h"

static int controlled;
void controllerPidInit(void) {}
bool controllerPidTest(void) { return true; }
void controllerPid(control_t *control, const setpoint_t *setpoint, const sensorData_t *sensors, const state_t *state,
                   const stabilizerStep_t stabilizerStep) {
  (void)control, (void)setpoint, (void)sensors, (void)state, (void)stabilizerStep;
  controlled++;
}

static void controlTenTimes(int step) {
  if (step >= 50) {
    return;  // another controller is chosen
  }
  for (int i = 0; i < 10; i++) {
    const sensorData_t sensors = {{{0.1f * (float)i, 0.0f, 1.0f}}, {{(float)i, 0.0f, -90.0f}}};
    controllerOutOfTree(NULL, NULL, &sensors, NULL, 0);
  }
}

static void tap(void) {
  between = controlTenTimes;
  fly(60);
  check(controlled == 500, "the firmware's controller is called each time");
  check(fabsf(core.pipeline.held[0]) < 0.01f, "where it is not called the log variables count");
}

static void tapMean(void) {
  between = controlTenTimes;
  fly(20);
  const float *held = core.pipeline.held;
  check(fabsf(held[0] - 0.45f * 9.81f) < 1e-4f && fabsf(held[2] - 9.81f) < 1e-4f, "the mean acceleration, in m/s^2");
  check(fabsf(held[3] - 0.0785398f) < 1e-5f && fabsf(held[5] + 1.5707963f) < 1e-5f, "the mean rate, in rad/s");
}
#endif

/** The PARAM group as a client finds it before the app has started. */
static void tables(void) {
  for (const variableEntry_t *entry = logs; entry->name != NULL; entry++) {
    const bool function = entry->type & LOG_BY_FUNCTION;
    const size_t field = function ? offsetof(appLog_t, health) : (size_t)((char *)entry->address - (char *)&core.log);
    printf("log %s.%s %d %zu\n", logGroup, entry->name, entry->type & ~LOG_BY_FUNCTION, field);
  }
  for (const variableEntry_t *entry = params; entry->name != NULL; entry++) {
    const double value = entry->type == PARAM_FLOAT   ? (double)*(float *)entry->address
                         : entry->type == PARAM_UINT8 ? *(uint8_t *)entry->address
                                                      : *(uint16_t *)entry->address;
    const size_t field = (size_t)((char *)entry->address - (char *)&wantedParams);
    printf("param %s.%s %d %zu %a\n", paramGroup, entry->name, entry->type, field, value);
  }
}

typedef struct {
  const char *name;
  void (*run)(void);
} scenario_t;

static const scenario_t scenarios[] = {
    {"silent", silent},
    {"missing-variable", missingVariable},
    {"parameters", parameters},
    {"write-between", writeBetween},
    {"stalled", stalled},
    {"late", late},
    {"tables", tables},
#ifdef CONFIG_DECK_AI
    {"gap8-on-request", gap8OnRequest},
    {"no-deck", noDeck},
    {"foreign", foreign},
#endif
#ifdef CONFIG_CONTROLLER_OOT
    {"tap", tap},
    {"tap-mean", tapMean},
#endif
};

int main(int argc, char **argv) {
  deck = argc > 2 ? (unsigned)atoi(argv[2]) : 1;
  for (unsigned i = 0; argc > 1 && i < sizeof scenarios / sizeof *scenarios; i++) {
    if (strcmp(argv[1], scenarios[i].name) == 0) {
      scenarios[i].run();
      return 0;
    }
  }
  fprintf(stderr, "no such scenario\n");
  return 2;
}

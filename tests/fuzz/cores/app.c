// app_core.h: everything that the STM32 app does. Any samples, packets, settings, times and transports; then a quiet
// flight with the settings as shipped. Promised: every log value is a number or NaN where app_types.h says so, counters
// only grow, what is sent is a packet, and in the quiet flight the chosen detector works again, GAP8 or none.
#include "app_core.h"
#include "airtouch_model.h"
#include "airtouch_rolling.h"
#include "forge.h"
#include "packet_table.h"
#include "stream_int8.h"
#include "toy_network.h"

// Steps of an input before the quiet flight, at most: few in most, and a window of samples and more in an eighth.
#define FEW_STEPS 120
#define MANY_STEPS 700
// Steps of the quiet flight, at most: the longest wait for a try, a window of new samples, and a few more.
#define QUIET (LINK_RETRY_MOST + 330)

#define LONGEST_STRIDE 4  // samples from one answer of a network to the next

static appCore_t *core;
static toyNetwork_t toys[3];
static linkNetwork_t networks[3];
static linkReceiver_t gap8;  // with the shipped models' names, and networks that cost nothing
static bool gap8Lives, transportTakes;
static uint32_t seed, steps;

static void makeGap8(void) {
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  toys[0] = toyMake(streamInt8Window(&airtouchStream), (uint16_t)airtouchStream.stride);
  toys[1] = toyMake(AIRTOUCH_MODEL_ROWS, 1);
  edgeLinkDigest(AIRTOUCH_STREAM_SHA256, digest);
  networks[0] = toyAsNetwork(&toys[0], EDGE_LINK_BEST, digest);
  edgeLinkDigest(AIRTOUCH_MODEL_SHA256, digest);
  networks[1] = toyAsNetwork(&toys[1], EDGE_LINK_PAPER, digest);
  toys[2] = toyMake(AIRTOUCH_ROLLING_ROWS, AIRTOUCH_ROLLING_STRIDE);
  edgeLinkDigest(AIRTOUCH_ROLLING_SHA256, digest);
  networks[2] = toyAsNetwork(&toys[2], EDGE_LINK_PAPER_STREAM, digest);
  linkReceiverInit(&gap8, networks, 3);
}

static void hover(appSample_t *sample) {
  *sample = (appSample_t){.acc = {0, 0, 9.81f}, .vbat = 3.8f, .attitude = {0, 0, 0, 1}};
  for (int i = 0; i < 3; i++) {
    sample->acc[i] += 0.3f * noise(&seed);
    sample->gyro[i] = 0.2f * noise(&seed);
  }
  for (int i = 0; i < 4; i++) {
    sample->pwm[i] = 42000.0f + 3000.0f * noise(&seed);
  }
}

/** Values that sensors have, with some among them that none has. */
static void takeSample(bytes_t *bytes, appSample_t *sample) {
  hover(sample);
  for (uint8_t i = takeByte(bytes); i < 64; i = (uint8_t)(i + 1 + takeByte(bytes) % 64)) {
    float *const value[16] = {sample->acc,          sample->acc + 1,      sample->acc + 2,      sample->gyro,
                              sample->gyro + 1,     sample->gyro + 2,     sample->pwm,          sample->pwm + 1,
                              sample->pwm + 2,      sample->pwm + 3,      &sample->vbat,        sample->attitude,
                              sample->attitude + 1, sample->attitude + 2, sample->attitude + 3, sample->acc};
    const float usual[16] = {10, 10, 10, 3, 3, 3, 2e4f, 2e4f, 2e4f, 2e4f, 4, 0.5f, 0.5f, 0.5f, 0.5f, 1e3f};
    *value[i % 16] = takeFloat(bytes, usual[i % 16]);
  }
  sample->accInBody = takeByte(bytes);
}

static bool numberOrNan(float x) { return !isinf(x); }

static void checkLog(void) {
  const appLog_t *log = &core->log;
  for (int i = 0; i < 3; i++) {
    CHECK(isnan(log->feature[i]) || (isfinite(log->feature[i]) && log->feature[i] >= 0.0f),
          "a feature is a number from 0 up");
    CHECK(isfinite(log->force[i]) && isfinite(log->logit[i]), "force and logits are numbers");
  }
  CHECK(isfinite(log->cfarPower) && log->cfarPower >= 0.0f, "the cell under test is a number from 0 up");
  CHECK(numberOrNan(log->threshold) && !(log->threshold < 0.0f), "a threshold is a number from 0 up, or NaN");
  CHECK(isnan(log->probability) || (log->probability >= 0.0f && log->probability <= 1.0f),
        "a probability is one, or NaN");
  CHECK(log->edge <= 3 && log->alert <= 1 && log->over <= 1 && log->detector <= APP_PAPER_STREAM_GAP8 &&
            log->link <= LINK_REFUSED,
        "codes are those that there are");
  CHECK(log->health < 2 * APP_OTHER_VEHICLE && log->edgeSample <= log->samples && log->load <= log->loadMax,
        "health and times fit");
}

static void checkGrowth(const appLog_t *before) {
  const appLog_t *log = &core->log;
  CHECK(log->nonFinite >= before->nonFinite && log->dropped >= before->dropped && log->lost >= before->lost &&
            log->timeouts >= before->timeouts && log->gap8Resets >= before->gap8Resets &&
            log->answers >= before->answers,
        "counters only grow");
  CHECK((uint16_t)(log->edges - before->edges) < 100 && (uint16_t)(log->paramErrors - before->paramErrors) < 100,
        "counters that wrap only grow");
}

static void receive(const uint8_t *packet, uint16_t length) {
  uint8_t *exact = exactCopy(packet, length);
  const appLog_t before = core->log;
  appCoreReceive(core, exact, length);
  checkLog();
  checkGrowth(&before);
  free(exact);
}

static void exchange(void) {
  uint8_t packed[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
  for (int i = 0; i < APP_PACKETS; i++) {
    const uint16_t length = appCoreOutgoing(core, packed);
    if (length == 0) {
      return;
    }
    CHECK(inTable(packed, length), "what is sent is a packet");
    appCoreSent(core, transportTakes);
    if (transportTakes && gap8Lives) {
      receive(reply, linkReceiverTake(&gap8, packed, length, reply));
    }
  }
}

static void doStep(const appSample_t *sample) {
  const appLog_t before = core->log;
  appSample_t *exact = exactCopy(sample, sizeof *sample);
  const bool reported = appCoreStep(core, exact);
  free(exact);
  steps++;
  checkLog();
  checkGrowth(&before);
  CHECK(core->log.samples == before.samples + 1 && core->log.nonFinite - before.nonFinite <= 10,
        "a step counts as one");
  CHECK(reported || core->log.edges == before.edges, "an edge of this step is reported at it");
  exchange();
  if (steps % 50 == 0 && gap8Lives) {
    uint8_t beat[EDGE_LINK_MAX_BYTES];
    receive(beat, linkReceiverHeartbeat(&gap8, steps, beat));
  }
}

/** Some bytes of the settings become others, whatever they mean. */
static void changeParams(bytes_t *bytes) {
  appParams_t params = core->params;
  for (uint8_t count = takeByte(bytes) % 8; count > 0; count--) {
    const uint32_t at = takeBelow(bytes, sizeof params / 4);
    takeInto(bytes, (uint8_t *)&params + 4 * at, 4);
  }
  const appLog_t before = core->log;
  const uint16_t errors = appCoreSetParams(core, &params);
  CHECK((uint16_t)(core->log.paramErrors - before.paramErrors) == errors, "settings that were put right are counted");
  appParams_t again = params;
  CHECK(appCoreSetParams(core, &again) == 0 && appParamsClamp(&again) == 0, "settings in force are in range");
}

static void start(uint8_t how) {
  memset(core, how, sizeof *core);
  appCoreInit(core, NULL, how & 1, how);
  checkLog();
}

static void doOne(bytes_t *bytes) {
  appSample_t sample;
  uint8_t packed[EDGE_LINK_MAX_BYTES + 30] = {0};
  const uint8_t what = takeByte(bytes);
  switch (what % 8) {
    case 0:
      for (int i = what / 8; i >= 0; i--) {
        hover(&sample);
        doStep(&sample);
      }
      break;
    case 1:
    case 2:
      takeSample(bytes, &sample);
      for (int i = what < 200 ? 0 : what - 200; i >= 0; i--) {
        doStep(&sample);
      }
      break;
    case 3:
      takeInto(bytes, &sample, sizeof sample);
      doStep(&sample);
      break;
    case 4: {
      const uint16_t length = (uint16_t)takeBelow(bytes, sizeof packed);
      takeInto(bytes, packed, length);
      receive(packed, length);
      break;
    }
    case 5:
      receive(packed, forge(bytes, what < 200 ? EDGE_LINK_RESULT - 1 : what, core->link.session, core->link.samples,
                            core->link.digest, packed));
      break;
    case 6: changeParams(bytes); break;
    default:
      gap8Lives = what & 8;
      transportTakes = what & 16 || what & 32;
      if (what >= 224) {
        linkReceiverInit(&gap8, networks, 3);
      } else if (what >= 208) {
        start(takeByte(bytes));
      }
      appCoreTime(core, takeBelow(bytes, 70000), what & 64);
      break;
  }
}

static bool works(uint8_t detector, uint32_t answers) {
  const appLog_t *log = &core->log;
  const bool gap8Runs = gap8Lives && core->haveGap8 && detector >= APP_BEST_GAP8;
  const bool best = detector == APP_BEST || detector == APP_BEST_GAP8;
  const bool silent = detector >= APP_BEST_GAP8 && !gap8Runs;  // the wanted detector cannot run where it should
  if (!isfinite(log->feature[0]) || !isfinite(log->threshold) || (!silent && log->health != 0)) {
    return false;
  }
  if (gap8Runs && log->link != LINK_UP) {
    return false;
  }
  return !(best || gap8Runs) || (isfinite(log->probability) && log->answers > answers);
}

/** The settings as shipped but for the detector, and hover: all is well after a known time. */
static void flyQuietly(uint8_t detector, bool live) {
  appParams_t params;
  appSample_t sample;
  appParamsDefaults(&params);
  params.detector = detector;
  gap8Lives = live;
  transportTakes = true;
  CHECK(appCoreSetParams(core, &params) == 0, "the shipped settings are in range");
  const appLog_t before = core->log;
  uint32_t answers = 0;
  for (int good = 0, i = 0; good < 4; i++) {
    answers = i % LONGEST_STRIDE == 0 ? core->log.answers : answers;
    hover(&sample);
    doStep(&sample);
    good = i % LONGEST_STRIDE < LONGEST_STRIDE - 1 ? good : (works(detector, answers) ? good + 1 : 0);
    CHECK(i < QUIET, "in a quiet flight the chosen detector works again");
  }
  CHECK(core->log.nonFinite == before.nonFinite && core->log.paramErrors == before.paramErrors,
        "nothing was put right");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t mode = takeByte(&bytes);
  const uint8_t end = takeByte(&bytes);
  core = rubbish(sizeof *core, 0);
  seed = mode;
  steps = 0;
  gap8Lives = transportTakes = true;
  makeGap8();
  start(mode);
  const uint32_t most = oneIn(8, data, size) ? MANY_STEPS : FEW_STEPS;
  while (bytes.left > 0 && steps < most) {
    doOne(&bytes);
  }
  if (end & 1 && oneIn(5, data, size)) {  // it costs more than all before it
    core->noSensor = false;
    flyQuietly(end / 4 % 5, end & 2);
  }
  free(core);
  return 0;
}

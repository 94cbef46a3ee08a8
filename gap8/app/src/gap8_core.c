#include "gap8_core.h"

#include <stddef.h>
#include <string.h>

#include "feature_window.h"

_Static_assert(AIRTOUCH_MODEL_COLUMNS * sizeof(float) == EDGE_LINK_SAMPLE_BYTES, "a sample is a row of features");
_Static_assert(AIRTOUCH_ROLLING_COLUMNS * sizeof(float) == EDGE_LINK_SAMPLE_BYTES, "a sample is a row of features");
_Static_assert(EDGE_DECODER_LOGITS <= EDGE_LINK_OUTPUTS && MOTION_CHANNELS <= EDGE_LINK_SAMPLE_BYTES,
               "the packets have room for channels and logits");
_Static_assert(AIRTOUCH_MODEL_OUTPUTS <= EDGE_LINK_OUTPUTS && AIRTOUCH_ROLLING_OUTPUTS <= EDGE_LINK_OUTPUTS,
               "an answer has room for the outputs");

static void resetBest(void *context) {
  gap8Core_t *core = context;
  streamInt8Reset(core->models.best, &core->best.state, core->best.arena);
}

static bool stepBest(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES], int8_t output[EDGE_LINK_OUTPUTS]) {
  gap8Core_t *core = context;
  const int8_t *logits = streamInt8Step(core->models.best, &core->best.state, (const int8_t *)sample);
  if (logits == NULL) {
    return false;
  }
  memcpy(output, logits, EDGE_DECODER_LOGITS);
  return true;
}

static void resetPaper(void *context) {
  gap8Paper_t *paper = &((gap8Core_t *)context)->paper;
  paper->rows = 0;
  paper->oldest = 0;
}

/** One column of the window, oldest row first, normalised by itself. */
static void normaliseColumn(gap8Paper_t *paper, int32_t c) {
  float *column = paper->column[c];
  int32_t row = paper->oldest;
  for (int32_t i = 0; i < AIRTOUCH_MODEL_ROWS; i++) {
    column[i] = paper->ring[row * AIRTOUCH_MODEL_COLUMNS + c];
    row = row + 1 < AIRTOUCH_MODEL_ROWS ? row + 1 : 0;
  }
  zScoreWindow(column, AIRTOUCH_MODEL_ROWS, 1, column);
  for (int32_t i = 0; i < AIRTOUCH_MODEL_ROWS; i++) {
    paper->window[i * AIRTOUCH_MODEL_COLUMNS + c] = column[i];
  }
}

static void meet(const teamInt8_t *team) {
  if (team->cores > 1) {
    team->barrier(team->context);
  }
}

/** One core's part: columns, then values, then what it has of each layer. */
static void sharePaper(gap8Core_t *core, const teamInt8_t *mine) {
  gap8Paper_t *paper = &core->paper;
  const networkInt8_t *network = core->models.paper;
  for (int32_t c = mine->core; c < AIRTOUCH_MODEL_COLUMNS; c += mine->cores) {
    normaliseColumn(paper, c);
  }
  meet(mine);
  const int32_t begin = shareBegin(GAP8_VALUES, mine->core, mine->cores);
  const int32_t end = shareBegin(GAP8_VALUES, mine->core + 1, mine->cores);
  networkInt8Quantise(network, paper->window + begin, end - begin, paper->quantised + begin);
  meet(mine);
  const int8_t *logits = networkInt8RunTeam(network, paper->quantised, paper->arena, mine);
  if (mine->core == 0) {
    paper->logits = logits;
  }
}

static void workOnPaper(void *argument) {
  gap8Core_t *core = argument;
  const gap8Team_t *team = core->team;
  const teamInt8_t mine = {.core = team->core(), .cores = team->cores, .barrier = team->barrier};
  sharePaper(core, &mine);
}

static void runPaper(gap8Core_t *core) {
  if (core->team != NULL) {
    core->team->fork(workOnPaper, core);
  } else {
    const teamInt8_t alone = {.core = 0, .cores = 1};
    sharePaper(core, &alone);
  }
}

static bool stepPaper(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES], int8_t output[EDGE_LINK_OUTPUTS]) {
  gap8Core_t *core = context;
  gap8Paper_t *paper = &core->paper;
  // Little endian at both ends.
  memcpy(paper->ring + paper->oldest * AIRTOUCH_MODEL_COLUMNS, sample, EDGE_LINK_SAMPLE_BYTES);
  paper->oldest = paper->oldest + 1 < AIRTOUCH_MODEL_ROWS ? paper->oldest + 1 : 0;
  paper->rows += paper->rows < AIRTOUCH_MODEL_ROWS ? 1 : 0;
  if (paper->rows < AIRTOUCH_MODEL_ROWS) {
    return false;
  }
  runPaper(core);
  memcpy(output, paper->logits, AIRTOUCH_MODEL_OUTPUTS);
  return true;
}

static void resetPaperStream(void *context) {
  gap8Core_t *core = context;
  rollingInt8Init(&core->paperStream.state, core->models.paperStream, AIRTOUCH_ROLLING_STRIDE, core->paperStream.arena);
}

/** Of the bits, since without a floating-point unit that is cheaper. */
static bool isFinite(const float values[AIRTOUCH_ROLLING_COLUMNS]) {
  uint32_t bits[AIRTOUCH_ROLLING_COLUMNS];
  memcpy(bits, values, sizeof bits);
  for (int32_t i = 0; i < AIRTOUCH_ROLLING_COLUMNS; i++) {
    if ((bits[i] & UINT32_C(0x7f800000)) == UINT32_C(0x7f800000)) {
      return false;
    }
  }
  return true;
}

static bool stepPaperStream(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES],
                            int8_t output[EDGE_LINK_OUTPUTS]) {
  gap8Core_t *core = context;
  float features[AIRTOUCH_ROLLING_COLUMNS];
  int8_t quantised[AIRTOUCH_ROLLING_COLUMNS];
  memcpy(features, sample, sizeof features);
  if (!isFinite(features)) {
    rollingInt8Reset(&core->paperStream.state);
    return false;
  }
  fixedScaleApply(core->models.paperStreamScale, features, features);
  networkInt8Quantise(core->models.paperStream, features, AIRTOUCH_ROLLING_COLUMNS, quantised);
  const int8_t *logits = rollingInt8Step(&core->paperStream.state, quantised);
  if (logits == NULL) {
    return false;
  }
  memcpy(output, logits, AIRTOUCH_ROLLING_OUTPUTS);
  return true;
}

static bool bestFits(const streamInt8_t *network) {
  return streamInt8Check(network) < 0 && streamInt8ArenaBytes(network) <= AIRTOUCH_STREAM_ARENA_BYTES &&
         network->convs[0].layer.inChannels == EDGE_LINK_SAMPLE_BYTES &&
         network->head->outChannels >= EDGE_DECODER_LOGITS;
}

/** Whether rows of features are the network's input, and its output `outputs` values. */
static bool takesFeatures(const networkInt8_t *network, int32_t columns, int32_t outputs) {
  const layerInt8_t *first = network->layers;
  return network->layerCount > 0 && networkInt8Check(network) < 0 && first->inColumns * first->inChannels == columns &&
         network->layers[network->layerCount - 1].outChannels == outputs;
}

static bool paperFits(const networkInt8_t *network) {
  return takesFeatures(network, AIRTOUCH_MODEL_COLUMNS, AIRTOUCH_MODEL_OUTPUTS) &&
         network->layers[0].inRows == AIRTOUCH_MODEL_ROWS &&
         networkInt8ArenaBytes(network) <= AIRTOUCH_MODEL_ARENA_BYTES;
}

/** Plans the network where its state will be; returns whether it fits. */
static bool planPaperStream(const gap8Models_t *models, rollingInt8_t *plan) {
  return takesFeatures(models->paperStream, AIRTOUCH_ROLLING_COLUMNS, AIRTOUCH_ROLLING_OUTPUTS) &&
         models->paperStreamScale->columns == AIRTOUCH_ROLLING_COLUMNS &&
         rollingInt8Plan(plan, models->paperStream, AIRTOUCH_ROLLING_STRIDE) &&
         rollingInt8PlanBytes(plan) <= AIRTOUCH_ROLLING_ARENA_BYTES;
}

static void addNetwork(gap8Core_t *core, int32_t *count, const char *sha256, linkNetwork_t network) {
  network.context = core;
  edgeLinkDigest(sha256, network.digest);
  core->networks[(*count)++] = network;
}

int32_t gap8CoreInit(gap8Core_t *core, const gap8Models_t *models, const gap8Team_t *team) {
  memset(core, 0, sizeof *core);
  core->models = *models;
  core->team = team;
  int32_t count = 0;
  if (bestFits(models->best)) {
    addNetwork(core, &count, AIRTOUCH_STREAM_SHA256,
               (linkNetwork_t){.reset = resetBest,
                               .step = stepBest,
                               .window = streamInt8Window(models->best),
                               .stride = (uint16_t)models->best->stride,
                               .algorithm = EDGE_LINK_BEST});
  }
  if (paperFits(models->paper)) {
    addNetwork(core, &count, AIRTOUCH_MODEL_SHA256,
               (linkNetwork_t){.reset = resetPaper,
                               .step = stepPaper,
                               .window = AIRTOUCH_MODEL_ROWS,
                               .stride = 1,
                               .algorithm = EDGE_LINK_PAPER});
  }
  if (planPaperStream(models, &core->paperStream.state)) {
    addNetwork(core, &count, AIRTOUCH_ROLLING_SHA256,
               (linkNetwork_t){.reset = resetPaperStream,
                               .step = stepPaperStream,
                               .window = (uint16_t)core->paperStream.state.receptiveSamples,
                               .stride = AIRTOUCH_ROLLING_STRIDE,
                               .algorithm = EDGE_LINK_PAPER_STREAM});
  }
  linkReceiverInit(&core->receiver, core->networks, (uint8_t)count);
  return count;
}

uint16_t gap8CoreTake(gap8Core_t *core, const uint8_t *bytes, uint16_t length, uint8_t *reply) {
  return linkReceiverTake(&core->receiver, bytes, length, reply);
}

uint16_t gap8CoreHeartbeat(gap8Core_t *core, uint32_t uptimeMs, uint8_t *bytes) {
  return linkReceiverHeartbeat(&core->receiver, uptimeMs, bytes);
}

// stream_int8.h: streaming networks of any small shape and weights, held against the same causal convolutions over the
// whole past; and shapes that are none.
#include "made_layer.h"
#include "stream_int8.h"

#define CONVS 5
#define SAMPLES 80
#define CHANNELS 6

static made_t made[CONVS + 1];
static streamConv_t convs[CONVS];
static int8_t rows[CONVS + 1][SAMPLES][MADE_OUTPUTS];  // inputs of each conv, then the last one's outputs
static int32_t steps;                                  // that were computed

static made_t takeDense(bytes_t *bytes, int32_t taps, int32_t channels, int32_t outputs, uint32_t *seed) {
  made_t one = {.layer = {.kind = LAYER_DENSE,
                          .inRows = taps,
                          .inColumns = 1,
                          .inChannels = channels,
                          .outRows = 1,
                          .outColumns = 1,
                          .outChannels = outputs,
                          .kernelRows = 1,
                          .kernelColumns = 1}};
  if (takeByte(bytes) & 1 && taps * channels % 4 == 0) {
    one.layer.kind = LAYER_SPARSE_DENSE;
  }
  takeWeights(bytes, &one, seed);
  return one;
}

static streamInt8_t build(bytes_t *bytes, uint32_t *seed) {
  streamInt8_t network = {.convs = convs, .convCount = 1 + takeByte(bytes) % CONVS, .stride = 1 + takeByte(bytes) % 4};
  int32_t channels = 1 + takeByte(bytes) % CHANNELS;
  const int32_t width = 1 + takeByte(bytes) % CHANNELS;  // of every conv that the head reads
  network.firstSkip = takeByte(bytes) % network.convCount;
  for (int32_t i = 0; i < network.convCount; i++) {
    const int32_t taps = 1 + takeByte(bytes) % 4;
    const int32_t outputs = i >= network.firstSkip ? width : 1 + takeByte(bytes) % CHANNELS;
    made[i] = takeDense(bytes, taps, channels, outputs, seed);
    convs[i] = (streamConv_t){
        .layer = made[i].layer, .dilation = i == 0 ? 1 : 1 + takeByte(bytes) % 8, .zeroPoint = (int8_t)takeByte(bytes)};
    channels = outputs;
  }
  made[CONVS] = takeDense(bytes, network.convCount - network.firstSkip, width, 1 + takeByte(bytes) % 3, seed);
  network.head = &made[CONVS].layer;
  return network;
}

/** The row of conv i at a step, from all rows of its input: the taps, oldest first, before the first row its zero. */
static void defineConv(const streamInt8_t *network, int32_t i, int32_t at, int8_t *out) {
  const streamConv_t *conv = &convs[i];
  const int32_t channels = conv->layer.inChannels;
  int8_t patch[MADE_VALUES];
  for (int32_t tap = 0; tap < conv->layer.inRows; tap++) {
    const int32_t row = at - (conv->layer.inRows - 1 - tap) * conv->dilation;
    for (int32_t c = 0; c < channels; c++) {
      patch[tap * channels + c] = row >= 0 ? rows[i][row][c] : (int8_t)conv->zeroPoint;
    }
  }
  (void)network;
  for (int32_t o = 0; o < conv->layer.outChannels; o++) {
    out[o] = defineOutput(&made[i], o, patch);
  }
}

/** What the head says at a sample at which the network runs. */
static void define(const streamInt8_t *network, int32_t sample, int8_t *out) {
  int8_t skips[MADE_VALUES];
  int32_t count = 0;
  for (int32_t i = 0; i < network->convCount; i++) {
    // The first conv reads every sample, the others a row of each step.
    defineConv(network, i, i == 0 ? sample : steps, rows[i + 1][steps]);
    for (int32_t c = 0; c < convs[i].layer.outChannels && i >= network->firstSkip; c++) {
      skips[count++] = rows[i + 1][steps][c];
    }
  }
  for (int32_t o = 0; o < network->head->outChannels; o++) {
    out[o] = defineOutput(&made[CONVS], o, skips);
  }
  steps++;
}

static void run(bytes_t *bytes, const streamInt8_t *network, uint32_t *seed) {
  int8_t *arena = rubbish((size_t)streamInt8ArenaBytes(network), 0x44);
  const int32_t channels = convs[0].layer.inChannels;
  streamState_t state;
  steps = 0;
  streamInt8Reset(network, &state, arena);
  for (int32_t i = 0; i < SAMPLES && (i < 20 || bytes->left > 0); i++) {
    int8_t right[MADE_OUTPUTS];
    for (int32_t c = 0; c < channels; c++) {
      rows[0][i][c] = bytes->left > 0 ? (int8_t)takeByte(bytes) : (int8_t)(127.0f * noise(seed));
    }
    int8_t *exact = exactCopy(rows[0][i], (size_t)channels);
    const int8_t *said = streamInt8Step(network, &state, exact);
    free(exact);
    CHECK((said != NULL) == (i % network->stride == 0), "the network runs on every stride-th sample");
    if (said != NULL) {
      define(network, i, right);
      CHECK(memcmp(said, right, (size_t)network->head->outChannels) == 0, "a step is that of the whole past");
    }
  }
  free(arena);
}

/** A shape of any numbers: the check says so, and never fails. */
static void distort(bytes_t *bytes, streamInt8_t *network) {
  layerInt8_t head = *network->head;
  network->head = &head;
  for (int32_t i = 1 + takeByte(bytes) % 4; i > 0; i--) {
    streamConv_t *conv = &convs[takeByte(bytes) % CONVS];
    int32_t *const field[] = {&conv->layer.kind,       &conv->layer.inRows,  &conv->layer.inColumns,
                              &conv->layer.inChannels, &conv->layer.outRows, &conv->layer.outChannels,
                              &conv->dilation,         &head.inRows,         &head.inChannels,
                              &head.outChannels,       &network->firstSkip,  &network->stride,
                              &network->convCount};
    int32_t *const value = field[takeByte(bytes) % 13];
    const uint8_t how = takeByte(bytes);
    *value =
        how & 1 ? (int32_t)takeWord(bytes) : (how & 2 ? *value + (int8_t)takeByte(bytes) : (int32_t)(1u << how % 31));
  }
  if (network->convCount <= CONVS || network->convCount > STREAM_MAX_CONVS) {
    const int32_t first = streamInt8Check(network);
    CHECK(first == -1 || network->convCount < 1 || first <= network->convCount,
          "the check names a conv, the head or none");
    CHECK(first != -1 || streamInt8ArenaBytes(network) > 0, "a network that is accepted has an arena that exists");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  uint32_t seed = kind;
  streamInt8_t network = build(&bytes, &seed);
  CHECK(streamInt8Check(&network) == -1, "layers that fit are accepted");
  if (kind & 1) {
    distort(&bytes, &network);
  } else {
    run(&bytes, &network, &seed);
  }
  for (int32_t i = 0; i <= CONVS; i++) {
    freeLayer(&made[i]);
  }
  return 0;
}

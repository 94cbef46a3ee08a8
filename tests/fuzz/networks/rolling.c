// rolling_int8.h: windowed networks of any small shape and weights that can roll, held against the definition over each
// whole window.
#include "made_layer.h"
#include "rolling_int8.h"

#define LAYERS 5
#define SAMPLES 60

static made_t made[LAYERS];
static layerInt8_t layers[LAYERS];

static int32_t build(bytes_t *bytes, uint32_t *seed) {
  int32_t rows = 1 + takeByte(bytes) % 24, columns = 1 + takeByte(bytes) % 3, channels = 1 + takeByte(bytes) % 4;
  int32_t count = 0;
  const int32_t wanted = 1 + takeByte(bytes) % LAYERS;
  for (int32_t tries = 0; tries < 3 * wanted && count < wanted; tries++) {
    if (takeLayer(bytes, &made[count], rows, columns, channels, seed)) {
      layers[count] = made[count].layer;
      rows = layers[count].outRows;
      columns = layers[count].outColumns;
      channels = layers[count].outChannels;
      count++;
    }
  }
  return count;
}

static void run(bytes_t *bytes, const networkInt8_t *network, rollingInt8_t *rolling, uint32_t *seed) {
  int8_t samples[SAMPLES][12], in[MADE_VALUES], out[MADE_VALUES];
  const layerInt8_t *first = &layers[0];
  const int32_t values = first->inColumns * first->inChannels;
  for (int32_t i = 0; i < SAMPLES; i++) {
    for (int32_t c = 0; c < values; c++) {
      samples[i][c] = bytes->left > 0 ? (int8_t)takeByte(bytes) : (int8_t)(127.0f * noise(seed));
    }
  }
  for (int32_t i = 0; i < SAMPLES; i++) {
    int8_t *exact = exactCopy(samples[i], (size_t)values);
    const int8_t *said = rollingInt8Step(rolling, exact);
    free(exact);
    const bool due = i + 1 >= rolling->receptiveSamples && (i + 1) % rolling->stride == 0;
    CHECK(said == NULL || due, "outputs come on every stride-th sample, once enough has been seen");
    const int32_t newest = i + rolling->ahead;  // the window that the output is of ends here
    CHECK(said != NULL || !due || (i + 1) / rolling->stride * rolling->stride != i + 1, "no output is left out");
    if (said == NULL || newest >= SAMPLES || newest + 1 < first->inRows) {
      continue;
    }
    for (int32_t r = 0; r < first->inRows; r++) {
      memcpy(in + r * values, samples[newest + 1 - first->inRows + r], (size_t)values);
    }
    for (int32_t k = 0; k < network->layerCount; k++) {
      defineLayer(&made[k], in, out);
      memcpy(in, out, (size_t)sizeOut(&layers[k]));
    }
    CHECK(memcmp(said, in, (size_t)sizeOut(&layers[network->layerCount - 1])) == 0,
          "an output is that of the whole window");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  uint32_t seed = kind;
  const networkInt8_t network = {
      .layers = layers, .layerCount = build(&bytes, &seed), .inputScale = 1.0f, .outputScale = 1.0f};
  const int32_t stride = kind & 1 ? 1 << kind / 2 % 5 : takeByte(&bytes) % (ROLLING_MAX_STRIDE + 2);
  rollingInt8_t rolling;
  const int32_t room = network.layerCount > 0 ? rollingInt8ArenaBytes(&network, stride) : 0;
  if (room > 0) {
    int8_t *arena = rubbish((size_t)room, 0x55);
    CHECK(rollingInt8Init(&rolling, &network, stride, arena), "what has an arena can roll");
    run(&bytes, &network, &rolling, &seed);
    rollingInt8Reset(&rolling);
    run(&bytes, &network, &rolling, &seed);
    free(arena);
  }
  for (int32_t i = 0; i < LAYERS; i++) {
    freeLayer(&made[i]);
  }
  return 0;
}

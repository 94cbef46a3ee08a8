// network_int8.h: networks of any small shape and weights, and shapes that are none. What the check accepts runs within
// its arena, gives the definition's outputs to the last bit, and the same shared among any number of cores.
#include "made_layer.h"
#include "network_int8.h"

#define LAYERS 6

static made_t made[LAYERS];
static layerInt8_t layers[LAYERS];

static int32_t build(bytes_t *bytes, uint32_t *seed) {
  int32_t rows = 1 + takeByte(bytes) % 24, columns = 1 + takeByte(bytes) % 4, channels = 1 + takeByte(bytes) % 8;
  int32_t count = 0;
  const int32_t wanted = 1 + takeByte(bytes) % LAYERS;
  for (int32_t tries = 0; tries < 2 * wanted && count < wanted; tries++) {
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

/** One layer shared among cores, one after the other: together they write every output and nothing else. */
static void checkShares(const made_t *one, const int8_t *input, const int8_t *right, int32_t cores) {
  const int32_t size = sizeOut(&one->layer);
  int8_t *output = rubbish((size_t)size, 0x11);
  for (int32_t core = 0; core < cores; core++) {
    layerInt8Run(&(jobInt8_t){.layer = &one->layer, .input = input, .output = output, .core = core, .cores = cores});
  }
  CHECK(memcmp(output, right, (size_t)size) == 0, "cores that share a layer give the same");
  free(output);
}

static void runAll(bytes_t *bytes, const networkInt8_t *network, uint32_t *seed) {
  int8_t in[MADE_VALUES], out[MADE_VALUES];
  const int32_t size = sizeIn(&layers[0]);
  for (int32_t i = 0; i < size; i++) {
    in[i] = bytes->left > 0 ? (int8_t)takeByte(bytes) : (int8_t)(127.0f * noise(seed));
  }
  const int32_t room = networkInt8ArenaBytes(network);
  int8_t *input = exactCopy(in, (size_t)size), *arena = rubbish((size_t)room, 0x33);
  CHECK(room % 4 == 0 && room >= sizeOut(&layers[network->layerCount - 1]), "the arena holds the output");
  const int8_t *said = networkInt8Run(network, input, arena);
  CHECK(memcmp(in, input, (size_t)size) == 0, "the input stays as it is");
  for (int32_t i = 0; i < network->layerCount; i++) {
    defineLayer(&made[i], in, out);
    int8_t *exact = exactCopy(in, (size_t)sizeIn(&layers[i]));
    checkShares(&made[i], exact, out, 1 + takeByte(bytes) % 9);
    free(exact);
    memcpy(in, out, (size_t)sizeOut(&layers[i]));
  }
  CHECK(memcmp(said, in, (size_t)sizeOut(&layers[network->layerCount - 1])) == 0,
        "the network gives the definition's outputs");
  free(arena);
  free(input);
}

/** A shape of any numbers: the check says so, and never fails. */
static void distort(bytes_t *bytes, const networkInt8_t *network) {
  int32_t *const shape[] = {&layers[0].kind,        &layers[0].inRows,     &layers[0].inColumns,
                            &layers[0].inChannels,  &layers[0].outRows,    &layers[0].outColumns,
                            &layers[0].outChannels, &layers[0].kernelRows, &layers[0].kernelColumns};
  for (int32_t i = 1 + takeByte(bytes) % 4; i > 0; i--) {
    const int32_t layer = takeByte(bytes) % network->layerCount, field = takeByte(bytes) % 9;
    int32_t *const value = shape[field] + layer * (int32_t)(sizeof layers[0] / sizeof(int32_t));
    const uint8_t how = takeByte(bytes);
    *value =
        how & 1 ? (int32_t)takeWord(bytes) : (how & 2 ? *value + (int8_t)takeByte(bytes) : (int32_t)(1u << how % 31));
  }
  const int32_t first = networkInt8Check(network);
  CHECK(first >= -1 && first < network->layerCount, "the check names a layer, or none");
  for (int32_t i = 0; first < 0 && i < network->layerCount; i++) {
    const layerInt8_t *layer = &layers[i];
    const int64_t in = (int64_t)layer->inRows * layer->inColumns * layer->inChannels;
    const int64_t out = (int64_t)layer->outRows * layer->outColumns * layer->outChannels;
    CHECK(in > 0 && out > 0 && in <= INT32_MAX && out <= INT32_MAX, "a layer that is accepted has sizes that exist");
  }
}

static void quantise(bytes_t *bytes) {
  const networkInt8_t network = {.inputScale = fabsf(takeFinite(bytes, 0.05f, 1e3f)) + 1e-6f,
                                 .inputZeroPoint = (int8_t)takeByte(bytes)};
  float x[8];
  int8_t q[8];
  for (int i = 0; i < 8; i++) {
    x[i] = takeFloat(bytes, 3.0f);
  }
  networkInt8Quantise(&network, x, 8, q);
  for (int i = 0; i < 8; i++) {
    const double right =
        isnan(x[i]) ? network.inputZeroPoint : floor((double)x[i] / network.inputScale + 0.5) + network.inputZeroPoint;
    const double limited = fmax(-128.0, fmin(right, 127.0));
    CHECK(fabs(q[i] - limited) <= 1.0, "an input is quantised to the nearest step");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t kind = takeByte(&bytes);
  uint32_t seed = kind;
  quantise(&bytes);
  const networkInt8_t network = {
      .layers = layers, .layerCount = build(&bytes, &seed), .inputScale = 1.0f, .outputScale = 1.0f};
  if (network.layerCount > 0) {
    CHECK(networkInt8Check(&network) == -1, "layers that fit are accepted");
    if (kind & 1) {
      distort(&bytes, &network);
    } else {
      runAll(&bytes, &network, &seed);
    }
  }
  for (int32_t i = 0; i < LAYERS; i++) {
    freeLayer(&made[i]);
  }
  return 0;
}
